"""Promises of rays and trees."""
