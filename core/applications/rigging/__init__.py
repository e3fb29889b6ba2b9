"""Weights of bones, their transfer, and surfaces that follow bones."""
