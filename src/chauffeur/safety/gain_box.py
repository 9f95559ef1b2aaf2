"""The certified box of gains: what an action matrix may hold (paper Eq. 22), published in `gain_box.json` beside this.

Every value was driven: `benchmarks/gain_box.py` drew gain sets from the box, drove each on three plants that are not
the controllers' own model, and cut the box until none of them broke a bound. The file holds box, bounds and the worst.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any, Final

from chauffeur.concept import ActionMatrix

GAIN_NAMES: Final = ("Kp", "Ki", "Kd", "Wl", "Wh", "Ws")
_ROUNDING: Final = 1e-9


@dataclass(frozen=True, slots=True)
class GainBox:
    """Lowest and highest certified value of each gain, by its name in `GAIN_NAMES`, and how it was certified."""

    low: dict[str, float]
    high: dict[str, float]
    certificate: dict[str, Any]

    def outside(self, policy: ActionMatrix) -> list[tuple[str, float]]:
        """Gains beyond the box, as (name, value); what is no number is beyond it."""
        values = zip(GAIN_NAMES, (*policy.pid, *policy.mpc), strict=False)
        return [
            (name, value)
            for name, value in values
            if not self.low[name] - _ROUNDING <= value <= self.high[name] + _ROUNDING
        ]

    def clamped(self, policy: ActionMatrix) -> ActionMatrix:
        """The nearest action matrix inside."""
        kept = [
            min(max(value, self.low[name]), self.high[name])
            for name, value in zip(GAIN_NAMES, (*policy.pid, *policy.mpc), strict=True)
        ]
        return ActionMatrix((kept[0], kept[1], kept[2]), (kept[3], kept[4], kept[5]))


@cache
def gain_box() -> GainBox:
    """The box that ships."""
    found = json.loads(resources.files(__package__ or "").joinpath("gain_box.json").read_text(encoding="utf-8"))
    low, high = ({name: float(found["box"][name.lower()][end]) for name in GAIN_NAMES} for end in (0, 1))
    return GainBox(low, high, found)
