"""The only room that uses the CAD kernel: it reads documents, gives models and facts, applies edits, writes files."""
