"""What ``import mracad`` offers: edits and measurements of files, documents and shapes, in the words of Python."""
