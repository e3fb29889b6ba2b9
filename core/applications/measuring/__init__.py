"""Areas, lengths, volumes, sections and slopes of a surface."""
