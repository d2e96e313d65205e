"""Trees: built, checked, refitted and stored."""
