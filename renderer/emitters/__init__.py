"""Emitters: one contract in ``base``, one file for each family."""
