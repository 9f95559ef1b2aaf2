"""Signals of a drive for the scores: numbers that no ruler changes, collected once a control period.

A rollout stores them, so that scoring it by another ruler costs no drive.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Literal

from chauffeur.concept import VehicleState
from chauffeur.worlds.base import EGO
from chauffeur.worlds.highway import Instant, RoadPerception

Fault = Literal["", "ego", "struck", "road_end"]
"""`ego`: it ran into something or cut in; `struck`: another vehicle ran into it; `road_end`: it only left the road
where the road ends; empty: nothing happened."""

_STANDING_MPS = 0.5
_KEPT_LANE_S = 2.0
_STEADY_RAD = math.radians(2.0)


def at_fault(road: RoadPerception, now: Instant, before: Sequence[Instant]) -> Fault:
    """Cause of the contact at `now`; `before` are the ego's earlier instants, the latest last.

    1. With an obstacle: the ego.
    2. The ego has been standing for 1 s: struck.
    3. The ego changed lanes within 2 s, or is heading out of its lane: the ego.
    4. The other is behind the ego in its lane: struck.
    5. The other came over from another lane while the ego kept its own: struck.
    6. Anything else, crossing traffic of the stop-controlled approach included: the ego.
    """
    other = _nearest(road, now)
    if other is None or other.kind == "obstacle":
        return "ego"
    if len(before) >= 10 and all(abs(i.speed_mps) < _STANDING_MPS for i in before[-10:]):
        return "struck"
    recent = before[-round(_KEPT_LANE_S * 10) :]
    steered = abs(math.remainder(now.heading_rad - road.lane_heading(now.lane), 2 * math.pi)) > _STEADY_RAD
    if steered or any(i.lane != now.lane for i in recent):
        return "ego"
    along = math.cos(now.heading_rad) * (other.x_m - now.x_m) + math.sin(now.heading_rad) * (other.y_m - now.y_m)
    turned = abs(math.remainder(other.heading_rad - now.heading_rad, 2 * math.pi)) > math.pi / 4
    if turned:
        return "ego"
    if along < 0:
        return "struck"
    came_over = abs(math.remainder(other.heading_rad - road.lane_heading(now.lane), 2 * math.pi)) > _STEADY_RAD
    return "struck" if came_over and other.speed_mps >= now.speed_mps else "ego"


def _nearest(road: RoadPerception, now: Instant) -> VehicleState | None:
    """Object that the ego touched: the crashed vehicle or the obstacle whose centre is nearest."""
    solid = [other for other in road.others() if other.kind == "obstacle" or other.crashed]
    return min(solid, key=lambda o: math.hypot(o.x_m - now.x_m, o.y_m - now.y_m), default=None)


STOP_ZONE_M = 15.0
"""Range in which a stop for a stop sign counts: this far before it, the ego's centre."""


@dataclass(frozen=True, slots=True)
class Signals:
    """Numbers of one drive.

    Attributes:
        steps: Control periods of 0.1 s.
        ttc_along_s: Least positive time to collision of LaMPilot's code; None for no conflict.
        ttc_plane_s: Least positive value of paper Eq. 1 (2-D, centres); None for none.
        ttc_lane_s: Least bumper-to-bumper time to collision in the ego's lane or width; 0 on contact, None for none.
        speed_mean_mps, speed_std_mps: Paper Eq. 5 and 4.
        crashed: Whether the ego was in a collision at any time.
        off_road, past_end: Whether it ended off the road; whether only because the road ended.
        stop_speed_mps: Lowest speed in the last 15 m before a stop sign that was passed; None where none was.
        fault: Who caused the collision, or the end of the road (fault.py).
    """

    steps: int
    ttc_along_s: float | None
    ttc_plane_s: float | None
    ttc_lane_s: float | None
    speed_mean_mps: float
    speed_std_mps: float
    crashed: bool
    off_road: bool
    past_end: bool
    stop_speed_mps: float | None
    fault: Fault

    def as_row(self) -> dict[str, float | bool | str | None]:
        """JSON form."""
        return asdict(self)


class SignalLog:
    """Collects signals; make it right after the world was reset."""

    def __init__(self, road: RoadPerception) -> None:
        self._road = road
        self._speeds: list[float] = []
        self._along = self._plane = self._lane = math.inf
        self._recent: list[Instant] = []
        self._crashed = False
        self._fault: Fault = ""
        sign = road.stop_sign_ahead(frozenset())
        self._sign = None if sign is None else sign[0]
        self._sign_lane = None if sign is None else road.lane_of(EGO)
        self._slowest = math.inf
        self._stop_speed: float | None = None

    @property
    def steps(self) -> int:
        """Control periods seen."""
        return len(self._speeds)

    def observe(self, now: Instant) -> None:
        """Look at the instant after a control period."""
        self._speeds.append(now.speed_mps)
        if 0 < now.ttc_along_s < self._along:
            self._along = now.ttc_along_s
        if 0 < now.ttc_plane_s < self._plane:
            self._plane = now.ttc_plane_s
        if 0 <= now.ttc_lane_s < self._lane:
            self._lane = now.ttc_lane_s
        if self._sign is not None:
            self._watch_sign(self._sign, now)
        if now.crashed and not self._crashed:
            self._crashed = True
            self._fault = at_fault(self._road, now, self._recent)
        self._recent.append(now)
        if len(self._recent) > 2 * _KEPT:
            del self._recent[:_KEPT]

    def _watch_sign(self, sign: int, now: Instant) -> None:
        if now.lane == self._sign_lane:
            ahead = self._road.distance_along(EGO, sign)
            if 0 <= ahead <= STOP_ZONE_M:
                self._slowest = min(self._slowest, now.speed_mps)
            if ahead >= 0:
                return
        self._sign = None  # passed
        self._stop_speed = self._slowest if math.isfinite(self._slowest) else now.speed_mps

    def signals(self) -> Signals:
        """The drive so far."""
        last = self._recent[-1] if self._recent else self._road.instant()
        mean = math.fsum(self._speeds) / len(self._speeds) if self._speeds else last.speed_mps
        variance = math.fsum((v - mean) ** 2 for v in self._speeds) / max(1, len(self._speeds))
        off_road = not last.on_road
        return Signals(
            steps=len(self._speeds),
            ttc_along_s=_finite(self._along),
            ttc_plane_s=_finite(self._plane),
            ttc_lane_s=_finite(self._lane),
            speed_mean_mps=mean,
            speed_std_mps=math.sqrt(variance),
            crashed=self._crashed,
            off_road=off_road,
            past_end=last.past_end,
            stop_speed_mps=self._stop_speed,
            fault=self._fault or ("road_end" if last.past_end else "ego" if off_road else ""),
        )


_KEPT = 30
"""Instants kept to see how a collision came about: 3 s."""


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
