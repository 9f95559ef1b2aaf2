"""Predicts other agents of a town over the next seconds, and where they meet the ego's line.

Everybody on a lane is taken to follow it, and each lane that it leads into, as fast as now or braking on as now; who is
ruled by a red light and can still stop, stops at its line. Everybody else goes straight on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from chauffeur.concept import Observation, VehicleState
from chauffeur.geometry import LaneId, RoadGraph, wrap_to_pi

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_STEP_S: Final = 0.5
TIMES_S: Final = np.arange(0.0, 6.01, _STEP_S)
_BACK_TO_THE_MIDDLE: Final = np.maximum(0.0, 1.0 - TIMES_S / 3.0)
"""Share of the offset from the lane's middle left at each of `TIMES_S`: none after 3 s."""
_MOST_DISCS: Final = 5
_SPREAD: Final = np.array(
    [
        np.pad(np.linspace(-1.0, 1.0, count) if count > 1 else np.zeros(count), (0, _MOST_DISCS - count))
        for count in range(_MOST_DISCS + 1)
    ]
)
"""Places of so many discs along a body, of half its length."""
_NOWHERE: Final = np.zeros(1)
_BEYOND_M: Final = 60.0
_WAYS: Final = 4
_ASTRAY_RAD: Final = 0.7
_ASIDE_M: Final = 2.2
_HARD_MPS2: Final = 5.0
_SLOW_MPS: Final = 0.15
_MARGIN_M: Final = 8.0
"""More than tables by the metre, and coming back to the middle of a lane, move anybody."""
_COARSE_M: Final = 8
"""Who is farther from every eighth point of a line, a metre apart, than this allows, is near none of the others."""
_ON_FOOT_MPS: Final = 0.05


@dataclass(frozen=True, slots=True)
class Meeting:
    """An agent's presence on the ego's line: where, and when at the soonest and at the latest.

    Attributes:
        other: Who.
        first_m, last_m: Stations of the line.
        enters_s, leaves_s: Times; the latest is that of the look ahead where it does not leave.
        along: Whether it goes the ego's way there.
        now: Whether it is there already.
        along_mps: Its speed along the line.
    """

    other: VehicleState
    first_m: float
    last_m: float
    enters_s: float
    leaves_s: float
    along: bool
    now: bool
    along_mps: float


class _LaneWay(NamedTuple):
    """A lane and what follows it: where its points begin in the table of all, and how many they are."""

    start: int
    points: int


class _Expected(NamedTuple):
    """A way that an agent may take.

    Attributes:
        other: Who.
        far: How far along it at `TIMES_S`, m; one value for who stands.
        way: Along lanes; None for straight on.
        station_m, aside_m: Where on those lanes, and how far left of their middle.
    """

    other: VehicleState
    far: Array
    way: _LaneWay | None = None
    station_m: float = 0.0
    aside_m: float = 0.0


class _Bodies(NamedTuple):
    """Discs that cover bodies, all (discs,): whose, at which of `TIMES_S`, where, and how wide they are."""

    owner: NDArray[np.int64]
    when: NDArray[np.int64]
    x: Array
    y: Array
    heading: Array
    radius: Array


class Foresight:
    """Looks ahead on one road; keeps the lines of its lanes."""

    def __init__(self, road: RoadGraph) -> None:
        self._road = road
        self._ways: dict[LaneId, tuple[_LaneWay, ...]] = {}
        self._points: Array = np.zeros((0, 3))
        """(x, y, heading) of all the ways known so far, every metre, one way after the other."""

    def meetings(
        self,
        seen: Observation,
        around: Sequence[VehicleState],
        line: tuple[Array, Array, Array],
        start_m: float,
        half_width_m: Array,
    ) -> list[Meeting]:
        """Agents that are, or may come to be, on a line.

        Args:
            seen: The instant.
            around: Those to be minded.
            line: (x, y, heading) of the line, every metre.
            start_m: Station of its first point.
            half_width_m: Of the body that goes along it, with what it keeps clear, at each of its points.
        """
        reds = {lane for signal in seen.signals if signal.state in ("red", "yellow") for lane in signal.lanes}
        x, y, heading = line
        expected: list[_Expected] = []
        widest = float(half_width_m.max())
        for other in around:
            apart_m2 = float(((x - other.x_m) ** 2 + (y - other.y_m) ** 2).min())
            reach = widest + _MARGIN_M + other.speed_mps * float(TIMES_S[-1]) + other.length_m + other.width_m
            if apart_m2 <= reach**2:  # else it cannot get there
                expected += self._expected(other, lane_stops=reds)
        if not expected:
            return []
        bodies = _covered(self._rows(expected), expected)
        near = _near(bodies, widest, x, y)
        bx, by, radius = bodies.x[near, None], bodies.y[near, None], bodies.radius[near, None]
        away: Array = (bx - x[None, :]) ** 2 + (by - y[None, :]) ** 2
        touching: NDArray[np.bool_] = away < (radius + half_width_m[None, :]) ** 2
        some: NDArray[np.bool_] = np.asarray(touching.any(axis=1))
        touching, near = touching[some], near[some]
        lowest = touching.argmax(axis=1)
        highest = touching.shape[1] - 1 - touching[:, ::-1].argmax(axis=1)
        owners, when = bodies.owner[near], bodies.when[near]
        found: list[Meeting] = []
        for owner in np.unique(owners).tolist():
            own = owners == owner
            times = when[own]
            soonest = own & (when == times.min())
            now = int(times.min()) == 0
            spans = soonest if now else own
            first, last = int(lowest[spans].min()), int(highest[spans].max())
            turned = wrap_to_pi(float(bodies.heading[near[soonest][0]]) - float(heading[first]))
            other = expected[owner].other
            found.append(
                Meeting(
                    other,
                    start_m + first,
                    start_m + last,
                    float(TIMES_S[times.min()]),
                    float(TIMES_S[times.max()]),
                    abs(turned) < _ASTRAY_RAD,
                    now,
                    other.speed_mps * math.cos(turned),
                )
            )
        return found

    def _expected(self, other: VehicleState, lane_stops: set[LaneId]) -> list[_Expected]:
        """Each way that an agent may take; one of no length for who stands."""
        speed = other.speed_mps
        if speed < (_ON_FOOT_MPS if other.kind == "pedestrian" else _SLOW_MPS):
            return [_Expected(other, _NOWHERE)]
        braking = max(-4.0, min(0.0, other.acceleration_mps2))
        lasts = np.minimum(TIMES_S, speed / -braking) if braking < -0.3 else TIMES_S
        far = speed * lasts + (0.5 * braking * lasts**2 if braking < -0.3 else 0.0)
        lane = self._road.get(other.lane)
        if other.kind == "pedestrian" or lane is None or lane.kind not in ("driving", "bicycle"):
            return [_Expected(other, far)]
        ways = self._ways_of(lane.id)
        length = round(lane.length_m)
        start = ways[0].start
        near = self._points[start : start + length + 1]
        at = int(((near[:, 0] - other.x_m) ** 2 + (near[:, 1] - other.y_m) ** 2).argmin())
        x, y, heading = near[at].tolist()
        c, s = math.cos(heading), math.sin(heading)
        aside = c * (other.y_m - y) - s * (other.x_m - x)
        if abs(wrap_to_pi(other.heading_rad - heading)) > _ASTRAY_RAD or abs(aside) > _ASIDE_M:
            return [_Expected(other, far)]
        left = length - at - other.length_m / 2.0
        if lane.id in lane_stops and speed * speed < 2.0 * _HARD_MPS2 * max(left, 0.0):
            far = np.minimum(far, left)
        station = at + c * (other.x_m - x) + s * (other.y_m - y)
        chosen = ways if far[-1] > length - at else ways[:1]
        return [_Expected(other, far, way, station, aside) for way in chosen]

    def _rows(self, expected: Sequence[_Expected]) -> Array:
        """(x, y, heading) at `TIMES_S` of who goes and at once of who stands, one after the other."""
        rows = np.repeat(
            [[one.other.x_m, one.other.y_m, one.other.heading_rad] for one in expected], _counts(expected), 0
        )
        starts = np.cumsum(_counts(expected)) - _counts(expected)
        straight = [i for i, one in enumerate(expected) if one.way is None and len(one.far) > 1]
        if straight:
            at = (starts[straight][:, None] + np.arange(len(TIMES_S))).ravel()
            far = np.concatenate([expected[i].far for i in straight])
            rows[at, 0] += np.cos(rows[at, 2]) * far
            rows[at, 1] += np.sin(rows[at, 2]) * far
        along = [(i, one, one.way) for i, one in enumerate(expected) if one.way is not None]
        if along:
            station = np.array([one.station_m for _, one, _ in along])[:, None]
            most = np.array([way.points - 1 for _, _, way in along])[:, None]
            first = np.array([way.start for _, _, way in along])[:, None]
            index = np.rint(station + np.stack([one.far for _, one, _ in along])).astype(np.int64)
            points = self._points[first + np.minimum(np.maximum(index, 0), most)]
            aside = np.array([one.aside_m for _, one, _ in along])[:, None] * _BACK_TO_THE_MIDDLE
            points[:, :, 0] -= np.sin(points[:, :, 2]) * aside
            points[:, :, 1] += np.cos(points[:, :, 2]) * aside
            at = starts[[i for i, _, _ in along]][:, None] + np.arange(1, len(TIMES_S))
            rows[at] = points[:, 1:]
        return rows

    def _ways_of(self, lane: LaneId) -> tuple[_LaneWay, ...]:
        ways = self._ways.get(lane)
        if ways is None:
            lines = [_lined(self._road, chain) for chain in self._chains(lane)]
            starts = np.cumsum([len(self._points), *map(len, lines)]).tolist()
            ways = tuple(_LaneWay(start, len(line)) for start, line in zip(starts, lines, strict=False))
            self._ways[lane] = ways
            self._points = np.concatenate([self._points, *lines])
        return ways

    def _chains(self, lane: LaneId) -> list[tuple[LaneId, ...]]:
        """A lane and what may follow it, as far as is looked."""
        done: list[tuple[LaneId, ...]] = []
        rim: list[tuple[tuple[LaneId, ...], float]] = [((lane,), 0.0)]
        while rim and len(done) < _WAYS:
            chain, beyond = rim.pop(0)
            onward = self._road[chain[-1]].successors
            if beyond > _BEYOND_M or not onward:
                done.append(chain)
                continue
            rim.extend(((*chain, one), beyond + self._road[one].length_m) for one in onward)
        return done


def _lined(road: RoadGraph, chain: Sequence[LaneId]) -> Array:
    rows: list[Array] = []
    for name in chain:
        line = road[name].centre
        x, y, heading = line.poses(np.linspace(0.0, line.length_m, max(2, round(line.length_m) + 1)))
        rows.append(np.stack([x, y, heading], axis=1))
    return np.concatenate([rows[0], *(row[1:] for row in rows[1:])])


def _discs(other: VehicleState) -> int:
    return max(1, min(_MOST_DISCS, math.ceil(other.length_m / max(other.width_m, 0.5) - 0.4)))


def _radius(other: VehicleState) -> float:
    """Of the discs that cover a body: half its width, and a little for what is between them."""
    return other.width_m / 2.0 + (0.1 if other.length_m > 1.5 * other.width_m else 0.0)


def _counts(expected: Sequence[_Expected]) -> NDArray[np.int64]:
    """Instants that are looked at of each."""
    return np.array([len(one.far) for one in expected], dtype=np.int64)


def _covered(rows: Array, expected: Sequence[_Expected]) -> _Bodies:
    """The discs that cover bodies at their instants."""
    others = [one.other for one in expected]
    discs = np.array([_discs(other) for other in others])
    half = np.array([max(0.0, other.length_m / 2.0 - other.width_m / 2.0) for other in others])
    # Who is fast must not leap over the line.
    half += np.array([max(0.0, other.speed_mps * _STEP_S - other.length_m) / 2.0 for other in others])
    counts = _counts(expected)
    owner = np.repeat(np.arange(len(expected)), counts)
    when = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    of_row = np.repeat(np.arange(len(rows)), discs[owner])
    first = np.cumsum(discs[owner]) - discs[owner]
    owner = owner[of_row]
    offsets = half[owner] * _SPREAD[discs[owner], np.arange(len(of_row)) - first[of_row]]
    cosine, sine = np.cos(rows[:, 2])[of_row], np.sin(rows[:, 2])[of_row]
    return _Bodies(
        owner,
        when[of_row],
        rows[of_row, 0] + cosine * offsets,
        rows[of_row, 1] + sine * offsets,
        rows[of_row, 2],
        np.array([_radius(other) for other in others])[owner],
    )


def _near(bodies: _Bodies, half_width_m: float, x: Array, y: Array) -> NDArray[np.int64]:
    """Discs that may touch an agent on a line: no other does, by a few of the line's points."""
    some = [*range(0, len(x), _COARSE_M), len(x) - 1]
    away = (bodies.x[:, None] - x[some]) ** 2 + (bodies.y[:, None] - y[some]) ** 2
    return np.flatnonzero(away.min(axis=1) < (bodies.radius + half_width_m + _COARSE_M / 2.0 + 0.1) ** 2)
