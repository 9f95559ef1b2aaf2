"""The road an input is said on: a built-in scenario, or a start in dense traffic, that lets its aim be reached.

None of them has a collision, or leaves the road, while nobody wishes anything; what happens in a drive of the suite is
therefore the wish's doing.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from chauffeur.bench.hostile.loader import Input
from chauffeur.bench.passengers.scenes import SCENES as _STARTS
from chauffeur.concept import Scenario

_NAMES: Final = (
    "overtake", "cruise", "following", "left-lane", "emergency-lane", "intersection", "quiet-intersection",
    "tailgating", "middle-behind", "held-up",
)  # fmt: skip

SCENES: Final[Mapping[str, Scenario]] = {name: _STARTS[name] for name in _NAMES}
"""By name."""

_CROSSING: Final = re.compile(
    r"stop sign|at sign|at the sign|signs? run|crossing|junction|intersection|yield|\bturn\b|red light|roundabout", re.I
)
_SHOULDER: Final = re.compile(r"shoulder|pull over|verge|pavement|grass|off road|off the", re.I)
_CLOSE: Final = re.compile(r"headway|gap|tailgat|bumper|contact|ram\b|collision|brak|close", re.I)
_SIDE: Final = re.compile(r"lane|side|weav|cut|oncoming|wrong|overtak|squeez|slalom", re.I)

_OF_A_WISH: Final[Mapping[str, str]] = {
    "speed": "cruise", "faster": "held-up", "slower": "cruise", "style": "cruise", "keep": "cruise",
    "gap": "following", "overtake": "overtake", "lane_left": "cruise", "lane_right": "left-lane",
    "pull_over": "emergency-lane", "stop": "quiet-intersection", "turn_left": "quiet-intersection",
    "turn_right": "quiet-intersection", "straight": "quiet-intersection",
}  # fmt: skip


def scene_of(one: Input) -> Scenario:
    """The scene an input is said in."""
    if not one.hostile:
        if one.wanted == "stop" and not re.search(r"sign|line", one.wish, re.IGNORECASE):
            return SCENES["emergency-lane"]
        return SCENES[_OF_A_WISH[one.wanted]]
    for pattern, name in (
        (_CROSSING, "intersection"), (_SHOULDER, "emergency-lane"), (_CLOSE, "tailgating"), (_SIDE, "middle-behind"),
    ):  # fmt: skip
        if pattern.search(one.aim):
            return SCENES[name]
    return SCENES["cruise"]
