"""The scenes the wishes are said in: built-in scenarios, and more starts on the same roads.

Each was chosen so that it begins without a crash, goes on without one while nobody wishes anything, and does not by
itself do what is wished in it. Speeds and gaps in the comments are those of the first instant.
"""

from __future__ import annotations

from typing import Any, Final

from chauffeur.concept import Scenario
from chauffeur.worlds.highway.scenarios import BUILT_IN


def _merge(count: int, density: float, lane: int) -> dict[str, Any]:
    """Two lanes, no shoulder."""
    return {
        "type": "ramp-merge-v0",
        "stage_length": [500, 80, 80, 2000],
        "vehicles_count": count,
        "vehicles_density": density,
        "ego_vehicle": {"speed": 25, "start_lane_index": ["c", "d", lane], "start_position": [105, 0]},
    }


def _lanes(count: int, density: float, lane: int, lanes: int, *, shoulder: bool) -> dict[str, Any]:
    """Several lanes; where there is a shoulder, it is the last of them."""
    return {
        "type": "dt-highway-v0",
        "num_lanes": lanes,
        "vehicles_count": count,
        "vehicles_density": density,
        "stage_length": [2000],
        "emergency_lane": shoulder,
        "ego_vehicle": {"speed": 25, "start_lane_index": ["a", "b", lane], "start_position": [105, 0]},
    }


def _crossing(left: int, right: int) -> dict[str, Any]:
    return {"type": "dt-intersection-v0", "num_vehicles_left": left, "num_vehicles_right": right}


def _scene(name: str, config: dict[str, Any], seed: int, title: str) -> Scenario:
    return Scenario(id=name, world="highway", config=config, seed=seed, title=title)


_MORE: Final = (
    # Nobody ahead, at the limit of 31.3 m/s.
    _scene("open-right", _merge(12, 0.2, 1), 7, "Right lane of two, free road"),
    _scene("open-left", _merge(40, 0.8, 0), 4, "Left lane of two, free road"),
    _scene("open-middle", _lanes(30, 0.6, 1, 3, shoulder=False), 3, "Middle lane of three, free road, no shoulder"),
    _scene("wide-middle", _lanes(40, 0.8, 2, 5, shoulder=True), 3, "Third lane of four, free road, a shoulder"),
    _scene("fast-lane-free", _lanes(60, 0.9, 0, 4, shoulder=True), 2, "Leftmost lane of three, free road, a shoulder"),
    _scene("shoulder-beside", _lanes(30, 0.4, 2, 4, shoulder=True), 1, "Rightmost lane, free road, shoulder beside"),
    # Somebody ahead, both at his speed.
    _scene("tailgating", _merge(40, 0.9, 1), 8, "15 m behind a car at 23 m/s, right lane of two"),
    _scene("close-behind", _merge(40, 0.9, 1), 10, "18 m behind a car at 20 m/s, right lane of two"),
    _scene("pulling-away", _merge(40, 0.9, 1), 24, "16 m behind a car at 19 m/s, right lane of two"),
    _scene("slow-truck", _merge(30, 0.5, 1), 12, "39 m behind a slow vehicle at 20 m/s, right lane of two"),
    _scene("crawl", _merge(40, 0.9, 1), 36, "35 m behind a very slow car at 15 m/s, right lane of two"),
    _scene("left-behind", _merge(60, 1.0, 0), 30, "30 m behind a car at 27 m/s, left lane of two"),
    _scene("left-close", _merge(30, 0.6, 0), 26, "15 m behind a car at 26 m/s, left lane of two"),
    _scene("left-slow", _lanes(30, 0.8, 0, 2, shoulder=False), 29, "33 m behind a car at 25 m/s, left lane of two"),
    _scene("middle-behind", _lanes(50, 1.0, 1, 3, shoulder=False), 36, "36 m behind a car at 26 m/s, middle of three"),
    _scene("wide-behind", _lanes(60, 1.2, 2, 5, shoulder=True), 33, "41 m behind a car at 25 m/s, third lane of four"),
    _scene("fast-lane-behind", _lanes(60, 1.1, 0, 4, shoulder=True), 19, "38 m behind a car at 28 m/s, leftmost lane"),
    _scene("shoulder-behind", _lanes(30, 0.4, 2, 4, shoulder=True), 2, "33 m behind a car at 28 m/s, shoulder beside"),
    _scene("single-lane", _lanes(14, 0.3, 0, 2, shoulder=True), 2, "29 m behind a car at 27 m/s, one lane, a shoulder"),
    # Held up by somebody who is going to leave room: whoever wishes to be faster can be, in the lane or past him.
    _scene("held-slow", _merge(30, 0.5, 1), 23, "45 m behind a car at 21 m/s, right lane of two"),
    _scene("held-up", _merge(40, 0.9, 1), 47, "43 m behind a car at 24 m/s, right lane of two"),
    _scene("held-right", _lanes(40, 0.9, 1, 2, shoulder=False), 18, "44 m behind a car at 25 m/s, right lane of two"),
    _scene("held-middle", _lanes(50, 1.0, 1, 3, shoulder=False), 12, "48 m behind a car at 28 m/s, middle of three"),
    _scene("held-left", _merge(60, 1.0, 0), 15, "41 m behind a car at 25 m/s, left lane of two"),
    _scene("held-shoulder", _lanes(60, 1.1, 1, 4, shoulder=True), 58, "35 m behind a car at 29 m/s, middle of three"),
    # Somebody slower ahead, coming nearer.
    _scene("steady", _lanes(14, 0.3, 1, 2, shoulder=False), 2, "73 m behind a car at 28 m/s, right lane of two"),
    _scene("catching-up", _merge(30, 0.5, 1), 21, "72 m behind a car at 24 m/s, right lane of two"),
    _scene("catch-shoulder", _lanes(50, 1.0, 1, 3, shoulder=True), 32, "55 m behind a car at 26 m/s, shoulder beside"),
    _scene("slow-ahead", _merge(70, 1.0, 1), 67, "50 m behind a slow car at 20 m/s, right lane of two"),
    _scene("coming-up", _lanes(30, 0.8, 0, 2, shoulder=False), 22, "60 m behind a car at 25 m/s, left lane of two"),
    # Crossings with a stop sign 85 m ahead.
    _scene("crossing-busy", _crossing(6, 6), 11, "Four-way crossing, stop sign, much traffic"),
    _scene("crossing-empty", _crossing(0, 0), 5, "Four-way crossing, stop sign, no traffic"),
)

SCENES: Final[dict[str, Scenario]] = {scene.id: scene for scene in (*BUILT_IN, *_MORE)}
"""Every scene a wish may be said in, by its name."""
