"""The public names of core: what everyone needs, and what the namespaces give."""

import core

SPACES = {space: list(core._read(f"{space}/__init__.py")) for space in core._NAMESPACES}
PLAIN = {"files", "tiles"}  # of which only some are explained by examples
FIRST = {  # of these, too
    "paper": ["Stability", "build_laplacian", "check_stability"],
    "splats": ["Splats", "floaters", "read_splats", "write_splats"],
}
PUBLIC = {name: getattr(core, name) for name in core.__all__} | {
    f"{space}.{name}": one
    for space, names in SPACES.items()
    for name in ([] if space in PLAIN else FIRST.get(space, names))
    if callable(one := getattr(getattr(core, space), name))
}
