"""Adapters of Mitsuba: its scenes, its hits, a Whitted recursion over it, and its own path integrators."""
