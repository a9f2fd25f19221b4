"""One module per command: its docstring is the help, ``command`` the click command."""
