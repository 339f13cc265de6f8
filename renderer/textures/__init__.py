"""Textures as kernels see them."""
