"""Blender operators: read the object, call core, write the result. No mathematics."""
