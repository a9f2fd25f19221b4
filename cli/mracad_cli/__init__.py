"""The command line of mracad."""
