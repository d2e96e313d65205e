"""Extreme cases: one file for each group, with shared judges and scenes."""
