"""Multiresolution on any nested knots: knot ladders, wavelets, analysis and synthesis, projections."""
