"""A CAD document as plain arrays (faces on surfaces, joined by edges), regions of faces, displacements, and facts."""
