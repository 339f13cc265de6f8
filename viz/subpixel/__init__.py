"""Subpixel filters as people see them: figures of kernels, spectra, methods and displays, each beside what thesis chapter 4 states."""
