"""An edit of its own for mracad: faces that rise towards their middles."""
