"""Images for the subpixels of a display: resolved from samples or from images, and judged (thesis 4.4, 4.5)."""
