"""The measured systems, each behind the same interface."""
