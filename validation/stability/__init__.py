"""The section that checks numerical stability: sweeps and extreme cases."""
