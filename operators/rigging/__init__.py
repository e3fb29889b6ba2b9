"""Armatures: weights of bones, and point clouds that follow them."""
