"""Promises of questions asked of a mesh."""
