"""What the modes of a surface are for: descriptors, matching, segments."""
