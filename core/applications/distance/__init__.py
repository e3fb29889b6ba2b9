"""Distances, paths and directions along a surface."""
