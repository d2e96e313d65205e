"""The section that checks pictures: the ladder of rungs, comparison, placement, random paths."""
