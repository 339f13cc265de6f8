"""Reconstruction filters: pure mathematics, shared by the film and by images resolved from tables."""

from renderer.filters.reconstruction import FILTERS, ReconstructionFilter, reconstruction_filter

__all__ = ["FILTERS", "ReconstructionFilter", "reconstruction_filter"]
