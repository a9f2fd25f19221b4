"""What is asked for: quantities, selectors, the options of every step, recipes."""
