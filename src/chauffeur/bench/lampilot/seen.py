"""A drive as an onlooker sees it: speeds, lanes, gaps, stops, a crash and with whom.

Everything is read off the recorded instants, so it knows nothing that the simulator keeps to itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from chauffeur.concept import LaneId, Observation, VehicleState
from chauffeur.driving.recording import RecordedTrip

STANDING_MPS = 0.5
_BESIDE_M = 2.5

Side = Literal["left", "right"]


@dataclass(frozen=True, slots=True)
class LaneMove:
    """The ego crossed into the lane beside its own: when, and to which side."""

    time_s: float
    side: Side


@dataclass(frozen=True, slots=True)
class SeenCommands:
    """A drive as an onlooker tells it. Times since the start of the drive.

    Attributes:
        duration_s: How long it was.
        speeds_mps: Ego speed at each instant, the last one included.
        moves: Lane changes, in order.
        first_gap_m, last_gap_m: Centre to centre to the car ahead in the ego's lane; None without one within 100 m.
        least_gap_m: The least of all; None if there never was one.
        last_lead_mps: Speed of the car ahead at the end.
        passed: Whether the car that was ahead at the start is more than 10 m behind at the end; None without one.
        emergency_s: When the ego was first in an emergency lane; None if never.
        stopped_s: When it first stood; None if never.
        turns: Routes the program asked for, in order, each once.
        exit_lane: Where it was at the end.
        ended_s: When the program finished; None if it ran to the end.
        hit: What it crashed into, in words; empty without a crash.
        road_ended: Whether it left the road where the road ends.
    """

    duration_s: float
    speeds_mps: tuple[float, ...]
    moves: tuple[LaneMove, ...]
    first_gap_m: float | None
    last_gap_m: float | None
    least_gap_m: float | None
    last_lead_mps: float | None
    passed: bool | None
    emergency_s: float | None
    stopped_s: float | None
    turns: tuple[str, ...]
    exit_lane: LaneId | None
    ended_s: float | None
    hit: str
    road_ended: bool

    @property
    def spread_mps(self) -> float:
        """Standard deviation of the speed."""
        mean = sum(self.speeds_mps) / len(self.speeds_mps)
        return math.sqrt(sum((speed - mean) ** 2 for speed in self.speeds_mps) / len(self.speeds_mps))

    @property
    def side(self) -> int:
        """Lanes to the right of where it began (negative: to the left), counted by its lane changes."""
        return sum(1 if move.side == "right" else -1 for move in self.moves)


_SIGHT_M = 100.0
_PASSED_M = 10.0
_ROAD_END_M = 30.0


def watch(recorded: RecordedTrip) -> SeenCommands | None:
    """Watch a recorded drive; None if nothing was driven."""
    frames = recorded.frames
    if not frames:
        return None
    final = recorded.final or frames[-1].observation
    shots = (*(frame.observation for frame in frames), final)
    start_s = shots[0].time_s
    gaps = [gap for shot in shots if (gap := _gap(shot)) is not None]
    emergency = {lane.id for lane in shots[0].road.lanes if lane.emergency}
    ended = next((f.observation.time_s - start_s for f in frames if f.program == "finished"), None)
    return SeenCommands(
        duration_s=recorded.trip.duration_s,
        speeds_mps=tuple(shot.ego.speed_mps for shot in shots),
        moves=_moves(shots),
        first_gap_m=_gap(shots[0]),
        last_gap_m=_gap(final),
        least_gap_m=min(gaps, default=None),
        last_lead_mps=final.front.speed_mps if final.front is not None and _gap(final) is not None else None,
        passed=_passed(shots[0], final),
        emergency_s=next((shot.time_s - start_s for shot in shots if shot.ego.lane in emergency), None),
        stopped_s=next((shot.time_s - start_s for shot in shots if shot.ego.speed_mps < STANDING_MPS), None),
        turns=tuple(dict.fromkeys(frame.setpoints.turn for frame in frames if frame.setpoints.turn)),
        exit_lane=final.ego.lane,
        ended_s=ended,
        hit=_hit(final),
        road_ended=final.off_road and _at_road_end(final),
    )


def _gap(shot: Observation) -> float | None:
    front = shot.front
    return front.distance_m if front is not None and front.distance_m <= _SIGHT_M else None


def _moves(shots: tuple[Observation, ...]) -> tuple[LaneMove, ...]:
    moves: list[LaneMove] = []
    for before, after in pairwise(shots):
        old, new = before.ego.lane, after.ego.lane
        # On one stretch of road only; the next stretch numbers its lanes afresh.
        places = None if old is None or new is None else after.road.places_between(old, new)
        if places:
            side: Side = "right" if places > 0 else "left"
            moves.append(LaneMove(after.time_s - shots[0].time_s, side))
    return tuple(moves)


def _ahead(ego: VehicleState, other: VehicleState) -> tuple[float, float]:
    """(metres ahead of the ego, metres to its right)."""
    dx, dy = other.x_m - ego.x_m, other.y_m - ego.y_m
    cos, sin = math.cos(ego.heading_rad), math.sin(ego.heading_rad)
    return dx * cos + dy * sin, dx * sin - dy * cos


def _passed(first: Observation, final: Observation) -> bool | None:
    if first.front is None or _gap(first) is None:
        return None
    lead = next((other for other in final.others if other.id == first.front.vehicle), None)
    return None if lead is None else _ahead(final.ego, lead)[0] < -_PASSED_M


def _hit(final: Observation) -> str:
    if not final.ego.crashed:
        return ""
    near = [o for o in (*final.others, *final.objects) if o.crashed or o.kind == "obstacle"]
    if not near:
        return "something"
    other = min(near, key=lambda o: math.hypot(o.x_m - final.ego.x_m, o.y_m - final.ego.y_m))
    if other.kind == "obstacle":
        return "an obstacle on the road"
    ahead, right = _ahead(final.ego, other)
    if abs(right) <= _BESIDE_M:
        return "the car ahead of it" if ahead > 0 else "a car behind it, which ran into it"
    return f"a car on its {'right' if right > 0 else 'left'}"


def _at_road_end(final: Observation) -> bool:
    ends = (lane.centre.points_m[-1] for lane in final.road.lanes)
    return any(math.dist((final.ego.x_m, final.ego.y_m), end) < _ROAD_END_M for end in ends)
