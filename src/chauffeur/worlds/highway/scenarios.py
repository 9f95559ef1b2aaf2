"""Built-in scenarios: start situations on LaMPilot's roads, chosen by us to show a kind of wish well."""

from __future__ import annotations

from typing import Any

from chauffeur.concept import Scenario

_MERGE: dict[str, Any] = {
    "type": "ramp-merge-v0",
    "stage_length": [500, 80, 80, 2000],
}


def _highway(count: int, density: float, lane: int, start_m: float = 105.0) -> dict[str, Any]:
    ego = {"speed": 25, "start_lane_index": ["c", "d", lane], "start_position": [start_m, 0]}
    return {**_MERGE, "vehicles_count": count, "vehicles_density": density, "ego_vehicle": ego}


def _emergency(lanes: int, count: int, density: float) -> dict[str, Any]:
    ego = {"speed": 25, "start_lane_index": ["a", "b", 1], "start_position": [105, 0]}
    return {
        "type": "dt-highway-v0",
        "num_lanes": lanes,
        "vehicles_count": count,
        "vehicles_density": density,
        "stage_length": [2000],
        "ego_vehicle": ego,
    }


def _crossing(left: int, right: int) -> dict[str, Any]:
    return {"type": "dt-intersection-v0", "num_vehicles_left": left, "num_vehicles_right": right}


def _built_in(name: str, config: dict[str, Any], seed: int, wish: str, title: str) -> Scenario:
    return Scenario(
        id=name, world="highway", config={**config, "redraw_unfit": True}, seed=seed, wish=wish, title=title
    )


BUILT_IN: tuple[Scenario, ...] = (
    _built_in(
        "overtake",
        _highway(24, 0.6, 1),
        17,
        "Overtake the car in front of you.",
        "Two-lane highway, right lane, a slower car ahead",
    ),
    _built_in(
        "following", _highway(30, 0.9, 1), 9, "Leave a bit more room to the car ahead.", "Behind a car, dense traffic"
    ),
    _built_in("cruise", _highway(12, 0.3, 1), 9, "Slow down to 90 km/h.", "Open highway, light traffic"),
    _built_in("left-lane", _highway(20, 0.5, 0), 19, "Move over to the right lane.", "Two-lane highway, left lane"),
    _built_in(
        "emergency-lane",
        _emergency(4, 14, 0.4),
        9,
        "Pull over on the shoulder, please.",
        "Three lanes and an emergency lane",
    ),
    _built_in(
        "intersection",
        _crossing(3, 3),
        41,
        "Turn left at the intersection.",
        "Four-way crossing, stop sign, crossing traffic",
    ),
    _built_in(
        "quiet-intersection",
        _crossing(1, 1),
        43,
        "Go straight on at the intersection.",
        "Four-way crossing, stop sign, hardly any traffic",
    ),
)
