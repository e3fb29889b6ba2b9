"""Surfaces that bend by handles, and that shrink to the least area."""
