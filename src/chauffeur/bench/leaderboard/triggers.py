"""Triggers of scenarios: the official trigger files, and which of their points lie on a route.

Both published forms are read: one JSON for all towns (Leaderboard 1.0's own: scenarios 1, 3 and 4), and a folder of
`ScenarioN/TownXX_ScenarioN.json` (transfuser's: 1, 3, 4, 7, 8, 9, 10).
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast

from chauffeur.bench.leaderboard.track import RouteTrack
from chauffeur.concept import DataError
from chauffeur.geometry import Pose, wrap_to_pi
from chauffeur.geometry.route import RoadOption

NEAR_M: Final = 2.0
"""A trigger closer than this to a point of the way lies on it."""
ALIKE_RAD: Final = math.radians(10.0)
"""Headings closer than this are the same."""
REACHED_M: Final = 1.5
"""The ego sets off a scenario within this distance of its trigger."""
TYPES: Final = tuple(range(1, 11))

_TURNS: Final[Mapping[int, tuple[RoadOption, ...]]] = {
    4: ("left", "right"),
    7: ("left", "right", "straight"),
    8: ("left",),
    9: ("right",),
}
"""Scenarios that need the way to do something at the next junction."""


@dataclass(frozen=True, slots=True)
class Trigger:
    """A trigger point: number of the scenario type and pose, right-handed frame."""

    scenario: int
    pose: Pose


@dataclass(frozen=True, slots=True)
class TriggerSet:
    """Trigger points by town, in the order of the files.

    Attributes:
        towns: The points.
        sha256: Of what was read.
    """

    towns: Mapping[str, tuple[Trigger, ...]]
    sha256: str


@dataclass(frozen=True, slots=True)
class Placed:
    """A scenario on a route.

    Attributes:
        trigger: What sets it off.
        index: Point of the way that it lies at.
        turn: What the way does at the next junction, where the scenario depends on it.
    """

    trigger: Trigger
    index: int
    turn: RoadOption | None

    def station_m(self, track: RouteTrack) -> float:
        """Position of its trigger along the way: what it puts on the road is that far from there, not from `index`,
        the first point near it."""
        at = self.trigger.pose
        return track.stations_m[self.index] + track.poses[self.index].sees(at.x_m, at.y_m)[0]


def read_triggers(path: Path) -> TriggerSet:
    """The trigger points of a JSON file, or of a folder of them.

    Raises:
        DataError: Nothing is there, or it is malformed; names the file.
    """
    files = sorted(path.glob("Scenario*/*.json"), key=_order) if path.is_dir() else [path]
    if not files:
        raise DataError(f"{path} has no ScenarioN/TownXX_ScenarioN.json.", hint="Name the file or the folder.")
    towns: dict[str, list[Trigger]] = {}
    digest = hashlib.sha256()
    for file in files:
        try:
            content = file.read_bytes()
        except OSError as error:
            raise DataError(f"The trigger file {file} cannot be read: {error.strerror}.") from error
        digest.update(content)
        try:
            for town, triggers in _read(json.loads(content)):
                towns.setdefault(town, []).extend(triggers)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise DataError(f"The trigger file {file} is malformed: {error!r}.") from error
    return TriggerSet({town: tuple(triggers) for town, triggers in towns.items()}, digest.hexdigest())


def place(track: RouteTrack, triggers: Sequence[Trigger]) -> tuple[Placed, ...]:
    """The scenarios of a route: triggers on the way, one at a spot (the highest number), in the order of the way.

    Of several of one number on a spot the first stands, as in the official matching.
    """
    spots: list[tuple[Pose, list[Placed]]] = []
    for trigger in triggers:
        index = track.matches(trigger.pose, NEAR_M, ALIKE_RAD)
        if index is None:
            continue
        turn = track.next_turn(index) if trigger.scenario in _TURNS else None
        if trigger.scenario in _TURNS and turn not in _TURNS[trigger.scenario]:
            continue
        found = Placed(trigger, index, turn)
        for pose, there in spots:
            if _same_spot(pose, trigger.pose):
                there.append(found)
                break
        else:
            spots.append((trigger.pose, [found]))
    chosen = [max(there, key=lambda one: one.trigger.scenario) for _, there in spots]
    return tuple(sorted(chosen, key=lambda one: one.index))


def _same_spot(one: Pose, other: Pose) -> bool:
    near = math.hypot(one.x_m - other.x_m, one.y_m - other.y_m) < NEAR_M
    return near and abs(wrap_to_pi(one.heading_rad - other.heading_rad)) < ALIKE_RAD


def _order(file: Path) -> tuple[int, str]:
    number = file.parent.name.removeprefix("Scenario")
    return (int(number) if number.isdigit() else 0, file.name)


def _read(content: Any) -> list[tuple[str, list[Trigger]]]:
    found: list[tuple[str, list[Trigger]]] = []
    for entry in cast("list[dict[str, list[dict[str, Any]]]]", content["available_scenarios"]):
        for town, scenarios in entry.items():
            triggers: list[Trigger] = []
            for scenario in scenarios:
                number = int(str(scenario["scenario_type"]).removeprefix("Scenario"))
                if number not in TYPES:
                    raise ValueError(f"scenario type {scenario['scenario_type']!r} is none of the ten")
                for event in scenario["available_event_configurations"]:
                    at = event["transform"]
                    x, y, yaw = float(at["x"]), float(at["y"]), float(at["yaw"])
                    if not all(map(math.isfinite, (x, y, yaw))):
                        raise ValueError(f"transform {at!r} is no place")
                    triggers.append(Trigger(number, Pose(x, -y, -math.radians(yaw))))
            found.append((town, triggers))
    return found
