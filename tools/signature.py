"""Heat and wave kernel signatures."""

from typing import Any

from . import core
from .quantities import HEAT_SIGNATURE, WAVE_SIGNATURE
from .settings import Choice, Setting
from .tool import Laplacian, Length, Outcome, Progress, Row, Tool


class Signature(Tool):
    """The tool."""

    name, label = "signature", "Signatures"
    help = "Compute heat or wave kernel signatures, which are unchanged by bending"
    settings = (
        Setting(
            "kind",
            "What spreads over the surface",
            "HEAT",
            choices=(
                Choice("HEAT", "Heat", "Heat that is left after some time: high on tips and thin parts"),
                Choice("WAVE", "Wave", "Waves of one energy: sharper, also for small features"),
            ),
        ),
        Setting("count", "How many scales, from fine to coarse", 8, 1, 999, label="Scales", high=50),
        Setting("modes", "How many vibration modes they are made of", 100, 10, high=300),
    )
    panel, menu = Row("Advanced", 3, 1), Row("Object", 5, 3)

    def later(self, own: Any) -> tuple[str, ...]:
        return "kind", "count"

    def writes(self, own: Any) -> tuple[str, ...]:
        prefix = HEAT_SIGNATURE if own.kind == "HEAT" else WAVE_SIGNATURE
        return tuple(f"{prefix}{number:03d}" for number in range(1, own.count + 1))

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        return laplacian.eigenpairs(own.modes, progress=progress)

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        signature = core.spectral.heat_kernel_signature if own.kind == "HEAT" else core.spectral.wave_kernel_signature
        values = signature(found, count=own.count).T
        return Outcome(dict(zip(self.writes(own), values, strict=True)), f"signatures at {own.count} scales")


TOOL = Signature()
