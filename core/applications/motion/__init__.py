"""Heat, waves, reactions and fronts that travel along a surface."""
