"""Detail features: named, told from what they stand above, and laid somewhere else."""
