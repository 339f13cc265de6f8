"""BSDFs: one file for each family, one contract in ``base``."""
