"""A CAD document as plain arrays: faces on surfaces, joined by edges; their regions; displacements; facts."""
