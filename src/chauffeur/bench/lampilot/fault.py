"""Who caused a collision: a geometric rule, looked at once, in the instant of contact.

It names the ego unless the contact shows otherwise, so that it never flatters. LaMPilot's traffic does not avoid the
ego (it takes it for a standing car), so being struck is possible and worth telling apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from chauffeur.concept import VehicleState
from chauffeur.worlds.highway import Instant, RoadPerception

Fault = Literal["", "ego", "struck", "road_end"]
"""`ego`: it ran into something or cut in; `struck`: another vehicle ran into it; `road_end`: it only left the road
where the road ends; empty: nothing happened."""

_STANDING_MPS = 0.5
_KEPT_LANE_S = 2.0
_STEADY_RAD = math.radians(2.0)


def at_fault(road: RoadPerception, now: Instant, before: Sequence[Instant]) -> Fault:
    """Who caused the contact at `now`; `before` are the ego's earlier instants, the latest last.

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
    """What the ego touched: the crashed vehicle or the obstacle whose centre is nearest."""
    solid = [other for other in road.others() if other.kind == "obstacle" or other.crashed]
    return min(solid, key=lambda o: math.hypot(o.x_m - now.x_m, o.y_m - now.y_m), default=None)
