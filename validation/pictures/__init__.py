"""The section on pictures: the ladder of rungs, comparison, placement, random paths."""
