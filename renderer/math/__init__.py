"""Vectors, warps and hashes that kernels share."""
