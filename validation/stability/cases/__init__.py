"""Extreme cases: one file a group of them, with their judges and scenes."""
