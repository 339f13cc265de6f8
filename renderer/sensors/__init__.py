"""Sensors: one contract in ``base``."""
