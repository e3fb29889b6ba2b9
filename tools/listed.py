"""All tools."""

from importlib import import_module
from pathlib import Path

from .tool import Tool


def listed_tools() -> list[Tool]:
    """Return the tools of all modules here that have one, by the names of these."""
    names = sorted(path.stem for path in Path(__file__).parent.glob("*.py"))
    modules = [import_module(f"{__package__}.{name}") for name in names if name not in ("__init__", "listed")]
    return [module.TOOL for module in modules if hasattr(module, "TOOL")]
