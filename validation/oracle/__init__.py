"""Exact arithmetic, the oracle of the suite. It shares no code with the renderer."""
