"""Rays against a tree: its records in memory, the triangle test, packets, streams and batches of queries."""
