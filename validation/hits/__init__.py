"""The section that checks hits: rays, comparison, verdicts, leaks."""
