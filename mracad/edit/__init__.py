"""The edits: each maps a model and its options to a displacement."""
