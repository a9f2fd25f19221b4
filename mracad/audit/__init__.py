"""Facts about models: continuity along seams, and how far an edit moved what."""
