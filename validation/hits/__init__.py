"""The section on hits: ray families, comparison, verdicts, leaks, refitted trees."""
