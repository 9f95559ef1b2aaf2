"""Over LaMPilot's crossing: one program for going straight on and one for turning, with their numbers.

They stop at the sign (below 1 m/s, lawfully), go once the braking that `is_safe_enter` foresees of the next car says
that there is time, and keep above 6 m/s in a turn, below which LaMPilot's vehicle model is numerically unstable.
Their speed changes a little so that others are level with the ego at the end of a control period, not just before:
LaMPilot's time to collision is read ten times a second, in every lane, and is least in the sample before a pass.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from chauffeur.planners.onboard.exemplars.texts import filled, read_texts

CROSSING: Final[dict[str, dict[str, float]]] = {
    "straight": {
        "HEADWAY": 0.01,
        "DIP": 8.0,
        "CRUISE": 5.5,
        "BRAKE": 4.5,
        "EASE": 5.0,
        "PACE": 7.754,
        "FLOOR": 5.886,
        "NEARBY": 2.0,
        "AHEAD": 14.066,
        "MOST": 11.0,
        "ENOUGH": 0.85,
        "LATE": 0.85,
        "CLIFF": 6.0,
        "SOFTEN": 0.065,
        "PULL": 0.02,
        "NEAR_OUT": 1.8,
        "NEAR_SPARE": 1.217,
        "BOX": 9.0,
        "FAR_OUT": 5.8,
        "FAR_SPARE": 0.8,
        "CROSS": 9.0,
        "CREEP": 0.606,
        "HOLD": 14.8,
        "TELL": 0.001,
    },
    "left": {
        "HEADWAY": 0.01,
        "DIP": 8.0,
        "CRUISE": 5.0,
        "BRAKE": 4.21,
        "EASE": 5.0,
        "PACE": 6.765,
        "FLOOR": 6.564,
        "NEARBY": 2.0,
        "AHEAD": 12.792,
        "MOST": 10.35,
        "ENOUGH": 0.85,
        "LATE": 0.876,
        "CLIFF": 11.597,
        "SOFTEN": 0.04,
        "PULL": 0.023,
        "WAY": 38.0,
        "WAY_OUT": 48.0,
        "NEAR_OUT": 1.8,
        "NEAR_SPARE": 1.3,
        "BOX": 9.0,
        "RIGHTWARDS": -1.0,
        "FAR_OUT": 4.0,
        "FAR_SPARE": 0.8,
        "ARC": 13.0,
        "GAIN": 0.4,
        "ROOM": 9.0,
        "CLOSE": 7.0,
        "TRUST": 0.5,
        "CROSS": 10.667,
        "CREEP": 0.692,
        "HOLD": 15.029,
        "TELL": 0.001,
    },
    "right": {
        "HEADWAY": 0.01,
        "DIP": 8.0,
        "CRUISE": 5.0,
        "BRAKE": 4.5,
        "EASE": 5.0,
        "PACE": 8.0,
        "FLOOR": 6.564,
        "NEARBY": 2.0,
        "AHEAD": 8.0,
        "MOST": 10.35,
        "ENOUGH": 0.85,
        "LATE": 0.876,
        "CLIFF": 11.597,
        "SOFTEN": 0.04,
        "PULL": 0.02,
        "WAY": 32.0,
        "WAY_OUT": 56.0,
        "NEAR_OUT": 4.0,
        "NEAR_SPARE": 1.3,
        "BOX": 9.0,
        "RIGHTWARDS": 1.0,
        "FAR_OUT": 0.0,
        "FAR_SPARE": 0.0,
        "ARC": 9.0,
        "GAIN": 0.4,
        "ROOM": 9.0,
        "CLOSE": 7.0,
        "TRUST": 0.5,
        "CROSS": 10.667,
        "CREEP": 0.692,
        "HOLD": 14.8,
        "TELL": 0.001,
    },
}
"""Numbers by direction: speeds in m/s, distances in m, times in s, accelerations in m/s2."""

ON_THE_WAY_M: Final = -45.0
"""How far behind the middle of the crossing a step ends when another one follows."""
DONE_M: Final = -300.0
"""And when none does."""


def crossing_program(side: str, changed: Mapping[str, float]) -> str:
    """The program for `left`, `right` or `straight`, with some numbers changed. KeyError for another side."""
    texts = read_texts("chauffeur.planners.onboard.exemplars", ("crossing",), "chauffeur.planners.onboard.exemplars")
    words = {name: repr(float(value)) for name, value in {**CROSSING[side], **changed}.items()}
    name = "cross" if side == "straight" else "turn"
    return filled(texts, name, words | {"TURN": f"turn_{side}"})
