"""Which version this is: what writes files says so in them."""

__version__ = "0.1.0"
