"""The example of CONTRIBUTING.md, as a module of the package of tools that is given."""

import re
from pathlib import Path
from types import ModuleType

TEXT = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8")


def example_tool(quantities, monkeypatch):
    """Return the tool of the example, for the package with this module of quantities, which gets its row."""
    code, row = (found for found in re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL) if "emoteness" in found)
    module = ModuleType(f"{quantities.__package__}.remoteness")
    module.__package__ = quantities.__package__
    exec(compile(code, "CONTRIBUTING.md", "exec"), module.__dict__)
    quantity = eval(row, {"Quantity": quantities.Quantity})
    monkeypatch.setattr(quantities, "QUANTITIES", (*quantities.QUANTITIES, quantity))
    monkeypatch.setitem(quantities._BY_NAME, quantity.attribute, quantity)
    return module.TOOL
