"""Deformation by handles: binding, following them live, baking."""
