"""Over LaMPilot's crossing: one program for going straight on and one for turning, with their numbers.

They stop at the sign (below 1 m/s, lawfully), go once the braking that `is_safe_enter` foresees of the next car says
that there is time, and keep above 6 m/s in a turn, below which LaMPilot's vehicle model is numerically unstable.
Their speed changes a little so that others are level with the ego at the end of a control period, not just before:
LaMPilot's time to collision is read ten times a second, in every lane, and is least in the sample before a pass.
"""

from __future__ import annotations

from collections.abc import Mapping
from string import Template
from typing import Final

from chauffeur.planners.onboard.exemplars.texts import read_texts

PACKAGE: Final = "chauffeur.planners.onboard.exemplars"

_EVERY: Final = {
    "HEADWAY": 0.01, "DIP": 8.0, "EASE": 5.0, "NEARBY": 2.0, "ENOUGH": 0.85, "BOX": 9.0, "TELL": 0.001,
}  # fmt: skip
"""Numbers of every way."""
_TURN: Final = {
    **_EVERY,
    "CRUISE": 5.0, "FLOOR": 6.564, "MOST": 10.35, "LATE": 0.876, "CLIFF": 11.597, "SOFTEN": 0.04, "NEAR_SPARE": 1.3,
    "GAIN": 0.4, "ROOM": 9.0, "CLOSE": 7.0, "TRUST": 0.5, "CROSS": 10.667, "CREEP": 0.692,
}  # fmt: skip
"""Of both turns."""
CROSSING: Final[dict[str, dict[str, float]]] = {
    "straight": {
        **_EVERY,
        "CRUISE": 5.5, "BRAKE": 4.5, "PACE": 7.754, "FLOOR": 5.886, "AHEAD": 14.066, "MOST": 11.0, "LATE": 0.85,
        "CLIFF": 6.0, "SOFTEN": 0.065, "PULL": 0.02, "NEAR_OUT": 1.8, "NEAR_SPARE": 1.217, "FAR_OUT": 5.8,
        "FAR_SPARE": 0.8, "CROSS": 9.0, "CREEP": 0.606, "HOLD": 14.8,
    },
    "left": {
        **_TURN,
        "BRAKE": 4.21, "PACE": 6.765, "AHEAD": 12.792, "PULL": 0.023, "WAY": 38.0, "WAY_OUT": 48.0, "NEAR_OUT": 1.8,
        "RIGHTWARDS": -1.0, "FAR_OUT": 4.0, "FAR_SPARE": 0.8, "ARC": 13.0, "HOLD": 15.029,
    },
    "right": {
        **_TURN,
        "BRAKE": 4.5, "PACE": 8.0, "AHEAD": 8.0, "PULL": 0.02, "WAY": 32.0, "WAY_OUT": 56.0, "NEAR_OUT": 4.0,
        "RIGHTWARDS": 1.0, "FAR_OUT": 0.0, "FAR_SPARE": 0.0, "ARC": 9.0, "HOLD": 14.8,
    },
}  # fmt: skip
"""Numbers by direction: speeds in m/s, distances in m, times in s, accelerations in m/s2."""

ON_THE_WAY_M: Final = -45.0
"""Distance behind the middle of the crossing at which a step ends when another one follows."""
DONE_M: Final = -300.0
"""And when none does."""


def crossing_program(side: str, changed: Mapping[str, float]) -> str:
    """The program for `left`, `right` or `straight`, with some numbers changed. KeyError for another side."""
    texts = read_texts(PACKAGE, ("crossing",), PACKAGE)
    words = {name: repr(float(value)) for name, value in {**CROSSING[side], **changed}.items()}
    name = "cross" if side == "straight" else "turn"
    return Template(texts[name]).substitute(words | {"TURN": f"turn_{side}"})
