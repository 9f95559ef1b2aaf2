"""Where the others of a town may be in the next seconds, and where that is on the ego's line.

Everybody on a lane is taken to follow it, and each lane that it leads into, as fast as now or braking on as now; who is
ruled by a red light and can still stop, stops at its line. Everybody else goes straight on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from chauffeur.concept import Observation, VehicleState
from chauffeur.geometry import LaneId, RoadGraph, wrap_to_pi

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_STEP_S: Final = 0.5
TIMES_S: Final = np.arange(0.0, 6.01, _STEP_S)
_BACK_TO_THE_MIDDLE: Final = np.maximum(0.0, 1.0 - TIMES_S / 3.0)
"""Who is beside the middle of their lane is back there after 3 s."""
_SPREAD: Final = (np.zeros(0), np.zeros(1), *(np.linspace(-1.0, 1.0, count) for count in range(2, 6)))
"""Places of so many discs along a body, of half its length."""
_BEYOND_M: Final = 60.0
_WAYS: Final = 4
_ASTRAY_RAD: Final = 0.7
_ASIDE_M: Final = 2.2
_HARD_MPS2: Final = 5.0
_SLOW_MPS: Final = 0.15
_MARGIN_M: Final = 8.0
"""More than tables by the metre, and coming back to the middle of a lane, move anybody."""
_ON_FOOT_MPS: Final = 0.05


@dataclass(frozen=True, slots=True)
class Meeting:
    """Where and when somebody is on the ego's line, at the soonest and at the latest.

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


class Foresight:
    """Looks ahead on one road; keeps the lines of its lanes."""

    def __init__(self, road: RoadGraph) -> None:
        self._road = road
        self._ways: dict[LaneId, tuple[Array, ...]] = {}

    def meetings(
        self,
        seen: Observation,
        around: Sequence[VehicleState],
        line: tuple[Array, Array, Array],
        start_m: float,
        half_width_m: Array,
    ) -> list[Meeting]:
        """Who is, or may come to be, on a line.

        Args:
            seen: The instant.
            around: Those to be minded.
            line: (x, y, heading) of the line, every metre.
            start_m: Station of its first point.
            half_width_m: Of the body that goes along it, with what it keeps clear, at each of its points.
        """
        reds = {lane for signal in seen.signals if signal.state in ("red", "yellow") for lane in signal.lanes}
        x, y, heading = line
        rows: list[Array] = []
        owners: list[tuple[VehicleState, int]] = []
        reach = float(half_width_m.max()) + _MARGIN_M
        for other in around:
            apart_m2 = float(((x - other.x_m) ** 2 + (y - other.y_m) ** 2).min())
            if apart_m2 > (reach + other.speed_mps * float(TIMES_S[-1]) + other.length_m + other.width_m) ** 2:
                continue  # it cannot get there
            for way in self._expected(other, lane_stops=reds):
                owners.append((other, _discs(other)))
                rows.append(_covered(way, other))
        if not rows:
            return []
        radius: Array = np.concatenate([np.full(len(r), _radius(o)) for r, (o, _) in zip(rows, owners, strict=True)])
        bodies = np.concatenate(rows)
        away: Array = (bodies[:, 0:1] - x[None, :]) ** 2 + (bodies[:, 1:2] - y[None, :]) ** 2
        touching: NDArray[np.bool_] = away < (radius[:, None] + half_width_m[None, :]) ** 2
        if not touching.any():
            return []
        some: NDArray[np.bool_] = np.asarray(touching.any(axis=1))
        lowest = np.argmax(touching, axis=1)
        highest = touching.shape[1] - 1 - np.argmax(touching[:, ::-1], axis=1)
        found: list[Meeting] = []
        at = 0
        for (other, discs), own in zip(owners, rows, strict=True):
            part = slice(at, at + len(own))
            at += len(own)
            hit = some[part]
            if not hit.any():
                continue
            when = np.repeat(np.arange(len(own) // discs), discs)[hit]
            first = int(lowest[part][hit].min())
            last = int(highest[part][hit].max())
            times = TIMES_S if len(own) // discs > 1 else TIMES_S[:1]
            now = int(when.min()) == 0
            soonest = hit & (np.repeat(np.arange(len(own) // discs), discs) == int(when.min()))
            if now:
                first = int(lowest[part][soonest].min())
                last = int(highest[part][soonest].max())
            turned = wrap_to_pi(float(own[soonest][0, 2]) - float(heading[first]))
            found.append(
                Meeting(
                    other,
                    start_m + first,
                    start_m + last,
                    float(times[when.min()]),
                    float(times[when.max()]),
                    abs(turned) < _ASTRAY_RAD,
                    now,
                    other.speed_mps * math.cos(turned),
                )
            )
        return found

    def _expected(self, other: VehicleState, lane_stops: set[LaneId]) -> list[Array]:
        """Rows of (x, y, heading) at `TIMES_S`, one array a way that it may take; one row for who stands."""
        speed = other.speed_mps
        here = np.array([[other.x_m, other.y_m, other.heading_rad]])
        if speed < (_ON_FOOT_MPS if other.kind == "pedestrian" else _SLOW_MPS):
            return [here]
        braking = max(-4.0, min(0.0, other.acceleration_mps2))
        lasts = np.minimum(TIMES_S, speed / -braking) if braking < -0.3 else TIMES_S
        far = speed * lasts + (0.5 * braking * lasts**2 if braking < -0.3 else 0.0)
        lane = self._road.get(other.lane)
        if other.kind == "pedestrian" or lane is None or lane.kind not in ("driving", "bicycle"):
            return [_straight(other, far)]
        ways = self._ways_of(lane.id)
        own = ways[0]
        length = round(lane.length_m)
        near = own[: length + 1]
        at = int(np.argmin((near[:, 0] - other.x_m) ** 2 + (near[:, 1] - other.y_m) ** 2))
        turned = wrap_to_pi(other.heading_rad - float(own[at, 2]))
        c, s = math.cos(own[at, 2]), math.sin(own[at, 2])
        aside = c * (other.y_m - own[at, 1]) - s * (other.x_m - own[at, 0])
        if abs(turned) > _ASTRAY_RAD or abs(aside) > _ASIDE_M:
            return [_straight(other, far)]
        left = length - at - other.length_m / 2.0
        if lane.id in lane_stops and speed * speed < 2.0 * _HARD_MPS2 * max(left, 0.0):
            far = np.minimum(far, left)
        station = at + c * (other.x_m - own[at, 0]) + s * (other.y_m - own[at, 1])
        found: list[Array] = []
        for way in ways if far[-1] > length - at else ways[:1]:
            index = np.minimum(np.maximum(np.rint(station + far).astype(np.int64), 0), len(way) - 1)
            rows = way[index]
            aside_now = aside * _BACK_TO_THE_MIDDLE
            rows[:, 0] -= np.sin(rows[:, 2]) * aside_now
            rows[:, 1] += np.cos(rows[:, 2]) * aside_now
            rows[0] = here[0]
            found.append(rows)
        return found

    def _ways_of(self, lane: LaneId) -> tuple[Array, ...]:
        ways = self._ways.get(lane)
        if ways is None:
            ways = self._ways[lane] = tuple(_lined(self._road, chain) for chain in self._chains(lane))
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


def _straight(other: VehicleState, far: Array) -> Array:
    c, s = math.cos(other.heading_rad), math.sin(other.heading_rad)
    return np.stack([other.x_m + c * far, other.y_m + s * far, np.full(len(far), other.heading_rad)], axis=1)


def _discs(other: VehicleState) -> int:
    return max(1, min(5, math.ceil(other.length_m / max(other.width_m, 0.5) - 0.4)))


def _radius(other: VehicleState) -> float:
    """Of the discs that cover a body: half its width, and a little for what is between them."""
    return other.width_m / 2.0 + (0.1 if other.length_m > 1.5 * other.width_m else 0.0)


def _covered(way: Array, other: VehicleState) -> Array:
    """The middles of the discs that cover a body, with its heading, those of one instant one after the other."""
    count = _discs(other)
    half = max(0.0, other.length_m / 2.0 - other.width_m / 2.0)
    half += max(0.0, other.speed_mps * _STEP_S - other.length_m) / 2.0  # who is fast must not leap over the line
    offsets = half * _SPREAD[count]
    found = np.empty((len(way), count, 3))
    found[:, :, 0] = way[:, 0:1] + np.cos(way[:, 2:3]) * offsets
    found[:, :, 1] = way[:, 1:2] + np.sin(way[:, 2:3]) * offsets
    found[:, :, 2] = way[:, 2:3]
    return found.reshape(-1, 3)
