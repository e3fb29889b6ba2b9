"""Blender's own tool for extensions, from its module: blender_extension.py COMMAND [ARGUMENT ...]."""

import importlib.util
import runpy
import sys
from pathlib import Path

if __name__ == "__main__":
    [scripts] = Path(importlib.util.find_spec("bpy").origin).parent.glob("*/scripts")
    tags = scripts / "modules" / "_bpy_internal" / "extensions" / "tags.py"  # those that Blender's platform knows
    sys.argv[0] = str(scripts / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py")
    if sys.argv[1] in ("build", "validate"):
        sys.argv[2:2] = ["--valid-tags", str(tags)]
    runpy.run_path(sys.argv[0], run_name="__main__")
