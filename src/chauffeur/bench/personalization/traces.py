"""A drive as what can be felt from the seat: a few numbers a control period, and what became of it.

Traces are small, so that drives of the same policy on the same scene can be shared by everybody who gets that policy.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chauffeur.bench.personalization.scoring import TripStatistics, statistics_of
from chauffeur.concept import Frame, Observation, VehicleState
from chauffeur.driving.episode import Episode

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

TRACE_VERSION: Final = "trace-v1"

_TOUCH_M: Final = 3.0
"""Middles of two cars on crossing ways that come this near use the same ground."""
_CROSSES_RAD: Final = math.radians(45.0)
_HULL_M: Final = 2.5
"""Radius of the disc that stands for a car where ways cross."""
_FAR_TTC_S: Final = 20.0
_JUNCTION_M: Final = 30.0
_AHEAD_RAD: Final = math.radians(60.0)


@dataclass(frozen=True, slots=True)
class Trace:
    """One drive. Arrays have one value a control period.

    Attributes:
        dt_s: Control period.
        outcome: As in `Episode`.
        limit_mps: Speed limit where it began.
        speed: m/s.
        acceleration: Really applied, m/s2.
        sideways: Speed times yaw rate, m/s2.
        turning: Yaw rate, rad/s.
        gap_m: Bumper to bumper, to whoever is ahead in the lane; infinite where nobody is.
        lead_speed: Their speed; infinite where nobody is.
        somebody_m: Way to whoever moves, or goes on foot, in sight ahead in a lot; infinite where nobody does.
        lane: Steps to the right of the lane it began in; along a route that turns, steps within the present road.
        passed: Whether the car that was ahead at the beginning is behind.
        ttc_s: Time to collision with whoever is ahead or crosses; infinite where nothing closes in.
        stop_m: Way to a stop sign ahead; infinite where none is.
        crossing: Whether somebody who crosses is near the junction.
        across: Whether the car has left the junction behind.
        encroachment: Of those who crossed, (index of the period, s by which they were missed), smallest first.
        parked: Name of the spot it stands in at the end.
        walk_m: For each place of a lot, how much farther this spot is than the best one; empty where not parked.
    """

    dt_s: float
    outcome: str
    limit_mps: float
    speed: Array
    acceleration: Array
    sideways: Array
    turning: Array
    gap_m: Array
    lead_speed: Array
    somebody_m: Array
    lane: NDArray[np.int64]
    passed: Flags
    ttc_s: Array
    stop_m: Array
    crossing: Flags
    across: Flags
    encroachment: tuple[tuple[int, float], ...] = ()
    parked: str = ""
    walk_m: dict[str, float] = field(default_factory=dict[str, float])

    @property
    def seconds(self) -> float:
        """Duration, s."""
        return len(self.speed) * self.dt_s

    def statistics(self) -> TripStatistics:
        """Compute the parts of the driving score. Raises ScenarioError for a drive that was over at once."""
        closing = [float(value) if math.isfinite(value) else None for value in self.ttc_s]
        return statistics_of(self.speed.tolist(), self.acceleration.tolist(), closing, self.dt_s)


def trace_of(episode: Episode, dt_s: float, *, parked: str = "", walk_m: dict[str, float] | None = None) -> Trace:
    """Look at a recorded drive.

    Args:
        episode: With its frames.
        dt_s: Control period.
        parked: Spot it stands in at the end.
        walk_m: See `Trace`.
    """
    frames = episode.frames
    shots = [frame.observation for frame in frames]
    egos = [shot.ego for shot in shots]
    speed = np.array([ego.speed_mps for ego in egos])
    turning = _turning(egos, dt_s)
    gaps, leads = _leads(shots)
    stops = np.array([_or_inf(shot.stop_sign_m) for shot in shots])
    crossers = _crossers(shots)
    closing = np.where(leads < speed, gaps / np.maximum(speed - leads, 1e-9), np.inf)
    if crossers:
        closing = np.minimum(closing, _crossing_ttc(egos, crossers))
    closing[closing > _FAR_TTC_S] = np.inf
    near = np.zeros(len(shots), dtype=np.bool_)
    for way in crossers.values():
        near |= np.hypot(way[:, 0], way[:, 1]) < _JUNCTION_M
    return Trace(
        dt_s=dt_s,
        outcome=episode.outcome,
        limit_mps=limit_of(shots[0]),
        speed=speed,
        acceleration=np.array([frame.applied.acceleration_mps2 for frame in frames]),
        sideways=speed * turning,
        turning=turning,
        gap_m=gaps,
        lead_speed=leads,
        somebody_m=_somebody(shots),
        lane=_lanes(frames),
        passed=_passed(shots),
        ttc_s=closing,
        stop_m=stops,
        crossing=near,
        across=_across(shots),
        encroachment=_encroachments(egos, crossers, dt_s),
        parked=parked,
        walk_m={} if walk_m is None else walk_m,
    )


def _or_inf(value: float | None) -> float:
    return math.inf if value is None else value


def limit_of(shot: Observation) -> float:
    """Speed limit where the ego is, m/s."""
    here = shot.road.get(shot.ego.lane) or shot.road.lanes[0]
    return here.speed_limit_mps


def _turning(egos: Sequence[VehicleState], dt_s: float) -> Array:
    headings = np.unwrap([ego.heading_rad for ego in egos])
    return np.gradient(headings, dt_s) if len(headings) > 1 else np.zeros(len(headings))


def _leads(shots: Sequence[Observation]) -> tuple[Array, Array]:
    gaps, speeds = np.full(len(shots), np.inf), np.full(len(shots), np.inf)
    for index, shot in enumerate(shots):
        if shot.front is None:
            continue
        lead = next((one for one in (*shot.others, *shot.objects) if one.id == shot.front.vehicle), None)
        if lead is None or lead.kind == "stop_sign":
            continue
        gaps[index] = max(0.0, shot.front.distance_m - (lead.length_m + shot.ego.length_m) / 2.0)
        speeds[index] = shot.front.speed_mps
    return gaps, speeds


def _somebody(shots: Sequence[Observation]) -> Array:
    """Whoever moves in front of the car in a lot; those who never move are parked."""
    found = np.full(len(shots), np.inf)
    if not shots[0].road.has_parking:
        return found
    first = {one.id: (one.x_m, one.y_m) for one in shots[0].others}
    movers = {one.id for one in shots[-1].others if first.get(one.id) != (one.x_m, one.y_m)}
    for index, shot in enumerate(shots):
        for one in shot.others:
            if one.id not in movers:
                continue
            x, y = one.x_m - shot.ego.x_m, one.y_m - shot.ego.y_m
            if abs(math.remainder(math.atan2(y, x) - shot.ego.heading_rad, 2.0 * math.pi)) < _AHEAD_RAD:
                found[index] = min(found[index], math.hypot(x, y))
    return found


def _lanes(frames: Sequence[Frame]) -> NDArray[np.int64]:
    road = frames[0].observation.road
    places = [road.get(frame.observation.ego.lane) for frame in frames]
    start = 0 if places[0] is None else places[0].index
    return np.array([0 if lane is None else lane.index - start for lane in places])


def _passed(shots: Sequence[Observation]) -> Flags:
    """Along the first heading of the car, which on a highway is the road's."""
    first = shots[0]
    behind = np.zeros(len(shots), dtype=np.bool_)
    if first.front is None:
        return behind
    c, s = math.cos(first.ego.heading_rad), math.sin(first.ego.heading_rad)
    for index, shot in enumerate(shots):
        lead = next((one for one in shot.others if one.id == first.front.vehicle), None)
        behind[index] = lead is None or (lead.x_m - shot.ego.x_m) * c + (lead.y_m - shot.ego.y_m) * s < -lead.length_m
    return behind


def _across(shots: Sequence[Observation]) -> Flags:
    """On the far side of the junction, which is the middle of its world."""
    first = shots[0].ego
    if not shots[0].road.junctions:
        return np.zeros(len(shots), dtype=np.bool_)
    began = math.hypot(first.x_m, first.y_m)
    inside = np.array([math.hypot(shot.ego.x_m, shot.ego.y_m) for shot in shots])
    driven = np.array([math.dist((first.x_m, first.y_m), (shot.ego.x_m, shot.ego.y_m)) for shot in shots])
    return (driven > began) & (inside > 10.0)


def _crossers(shots: Sequence[Observation]) -> dict[int, Array]:
    """Ways of those who cross the ego's, as (x, y, vx, vy) a period; empty away from intersections."""
    if not shots[0].road.junctions:
        return {}
    heading = shots[0].ego.heading_rad
    ways: dict[int, Array] = {}
    for index, shot in enumerate(shots):
        for one in shot.others:
            angle = abs(math.remainder(one.heading_rad - heading, math.pi))
            if angle < _CROSSES_RAD and one.id not in ways:
                continue
            if one.id not in ways:
                ways[one.id] = np.full((len(shots), 4), np.nan)
            velocity = one.speed_mps * math.cos(one.heading_rad), one.speed_mps * math.sin(one.heading_rad)
            ways[one.id][index] = one.x_m, one.y_m, *velocity
    return {name: np.nan_to_num(way, nan=1e6) for name, way in ways.items()}


def _crossing_ttc(egos: Sequence[VehicleState], crossers: dict[int, Array]) -> Array:
    """Until two discs touch, both keeping their speed and heading."""
    found = np.full(len(egos), np.inf)
    own = np.array(
        [(e.x_m, e.y_m, e.speed_mps * math.cos(e.heading_rad), e.speed_mps * math.sin(e.heading_rad)) for e in egos]
    )
    for way in crossers.values():
        apart = way - own
        a = np.sum(apart[:, 2:] ** 2, axis=1)
        b = 2.0 * np.sum(apart[:, :2] * apart[:, 2:], axis=1)
        c = np.sum(apart[:, :2] ** 2, axis=1) - (2.0 * _HULL_M) ** 2
        root = b**2 - 4.0 * a * c
        meets = (root > 0.0) & (b < 0.0) & (a > 1e-6) & (own[:, 2] ** 2 + own[:, 3] ** 2 > 0.25)
        when = np.where(meets, (-b - np.sqrt(np.maximum(root, 0.0))) / np.maximum(2.0 * a, 1e-9), np.inf)
        found = np.minimum(found, np.maximum(when, 0.0))
    return found


def _encroachments(
    egos: Sequence[VehicleState], crossers: dict[int, Array], dt_s: float
) -> tuple[tuple[int, float], ...]:
    """By how much time each who crossed was missed: from one leaving a piece of ground to the other coming to it."""
    own = np.array([(ego.x_m, ego.y_m) for ego in egos])
    found: list[tuple[int, float]] = []
    for way in crossers.values():
        apart = np.hypot(own[:, None, 0] - way[None, :, 0], own[:, None, 1] - way[None, :, 1])
        mine, theirs = np.nonzero(apart < _TOUCH_M)
        if len(mine):
            missed = np.abs(mine - theirs)
            least = int(np.argmin(missed))
            found.append((int(mine[least]), float(missed[least]) * dt_s))
    return tuple(sorted(found, key=lambda one: one[1]))
