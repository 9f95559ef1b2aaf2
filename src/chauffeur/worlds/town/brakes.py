"""Traffic that brakes for the ego wherever it stands in the way, as CARLA's Traffic Manager does.

SUMO's vehicles mind lanes and their right of way: one that has it turns through a car that waits inside the junction.
Here whoever would touch the ego within the time that braking takes brakes, and goes on once the way is free.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from chauffeur.concept import VehicleState
from chauffeur.geometry import Box, overlap, wrap_to_pi
from chauffeur.worlds.town.sumo import MAKES, Mover, Sumo

BRAKING_MPS2: Final = 6.0
REACTS_S: Final = 0.4
SIDE_M: Final = 0.3
"""Clearance kept around the ego."""
_NEAR_M: Final = 30.0
"""Distance up to which agents are looked at; fast ones from as far as they need to stop."""
_STEPS: Final = 6
_STEP_M: Final = 3.0
"""At most so much of their way from one look ahead to the next, so that nobody fast leaps over the ego."""
_MOST_YAW_RADPS: Final = 0.8
_CREEP_MPS: Final = 1.0
"""Speed at which there must be room before a vehicle held to a stand is let go; else it would creep into the ego."""


class TrafficBrakes:
    """Watches those around the ego, one control period after the other."""

    def __init__(self, sumo: Sumo, dt_s: float) -> None:
        self._sumo, self._dt_s = sumo, dt_s
        self._held: set[str] = set()
        self._headings: dict[str, float] = {}

    def mind(self, ego: VehicleState, movers: Sequence[Mover]) -> None:
        """Have those brake who would touch the ego, and let the others go."""
        seen: dict[str, float] = {}
        for one in movers:
            away = math.hypot(one.x_m - ego.x_m, one.y_m - ego.y_m)
            if away > max(_NEAR_M, one.speed_mps * (REACTS_S + one.speed_mps / (2.0 * BRAKING_MPS2)) + 10.0):
                continue
            before = self._headings.get(one.name, one.heading_rad)
            seen[one.name] = one.heading_rad
            yaw = wrap_to_pi(one.heading_rad - before) / self._dt_s
            speed = max(one.speed_mps, _CREEP_MPS) if one.name in self._held else one.speed_mps
            if self._touches(one, speed, max(-_MOST_YAW_RADPS, min(_MOST_YAW_RADPS, yaw)), ego, away):
                self._held.add(one.name)
                self._sumo.hold(one.name, max(0.0, one.speed_mps - BRAKING_MPS2 * self._dt_s))
            elif one.name in self._held:
                self._held.discard(one.name)
                self._sumo.hold(one.name, None)
        for name in sorted(self._held - seen.keys()):
            self._held.discard(name)
            self._sumo.hold(name, None)
        self._headings = seen

    @staticmethod
    def _touches(one: Mover, speed_mps: float, yaw_radps: float, ego: VehicleState, away_m: float) -> bool:
        """True if an agent that goes on as now touches the ego, which goes on as now, before it could stand."""
        make = MAKES[one.make]
        lasts = REACTS_S + speed_mps / BRAKING_MPS2
        reach = (speed_mps + ego.speed_mps) * lasts + (make.length_m + ego.length_m) / 2.0 + 2.0 * SIDE_M
        if speed_mps < 0.05 or away_m > reach:
            return False
        x, y, heading = one.x_m, one.y_m, one.heading_rad
        ego_x, ego_y = ego.x_m, ego.y_m
        steps = max(_STEPS, math.ceil(speed_mps * lasts / _STEP_M))
        step = lasts / steps
        meets = (math.hypot(make.length_m, make.width_m) + math.hypot(ego.length_m, ego.width_m)) / 2.0 + 2.0 * SIDE_M
        c, s = math.cos(ego.heading_rad), math.sin(ego.heading_rad)
        for _ in range(steps):
            heading += yaw_radps * step
            x, y = x + speed_mps * step * math.cos(heading), y + speed_mps * step * math.sin(heading)
            ego_x, ego_y = ego_x + ego.speed_mps * step * c, ego_y + ego.speed_mps * step * s
            if abs(x - ego_x) > meets or abs(y - ego_y) > meets:
                continue
            kept = Box(ego_x, ego_y, ego.heading_rad, ego.length_m + 2.0 * SIDE_M, ego.width_m + 2.0 * SIDE_M)
            if overlap(kept, Box(x, y, heading, make.length_m, make.width_m)):
                # Whoever is struck from behind cannot help it by braking.
                return c * (x - ego_x) + s * (y - ego_y) < 0.0 or math.cos(heading - ego.heading_rad) < 0.7
        return False
