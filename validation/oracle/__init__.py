"""Exact arithmetic, which shares no code with what it judges."""
