"""What commands say, made of their reports: one module a form."""
