"""The section on efficiency: error against run time."""
