"""The command line of mracad: one module a command in ``commands``."""
