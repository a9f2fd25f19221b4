"""One job from a file to files: steps, checks, outputs; limits around it; many files in a batch."""
