"""Promises of scenes of placed meshes."""
