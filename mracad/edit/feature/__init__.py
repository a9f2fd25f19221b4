"""Detail features: located, separated from the surface under them, and copied elsewhere."""
