"""Fewer, smoother and better points."""
