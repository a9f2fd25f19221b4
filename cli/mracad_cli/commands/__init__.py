"""One module a command; its docstring is the help, ``command`` the click command."""
