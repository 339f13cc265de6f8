"""Loops over rows of tables, compiled: one file for each question that they answer."""
