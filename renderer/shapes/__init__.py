"""Shapes as kernels see them."""
