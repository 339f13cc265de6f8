"""Small scenes as Mitsuba dictionaries, which both programs render."""
