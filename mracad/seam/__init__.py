"""Faces that move together: conditions along their seams, energies inside their trims, and the one solver."""
