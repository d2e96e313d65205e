"""The section that measures error against run time."""
