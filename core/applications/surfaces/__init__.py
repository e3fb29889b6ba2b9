"""Meshes of points."""
