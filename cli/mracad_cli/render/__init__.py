"""What commands print, made from their reports: one module per form."""
