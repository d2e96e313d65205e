"""Adapters of the references: each answers our questions by another system."""
