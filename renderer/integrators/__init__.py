"""Estimators: thin compositions of the wavefront's steps."""
