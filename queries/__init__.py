"""Tables to answers: views, light path expressions, resolved images."""
