"""Knot vectors, B-spline bases, Gram and refinement matrices, NURBS curves and nets."""
