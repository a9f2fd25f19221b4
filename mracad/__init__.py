"""Multiresolution editing for CAD models."""

__version__ = "0.1.0"
