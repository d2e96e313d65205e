"""The section on numerical stability: sweeps and extreme cases."""
