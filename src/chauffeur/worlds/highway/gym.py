"""LaMPilot's roads as gymnasium environments.

Importing this module registers `chauffeur/RampMerge-v0`, `chauffeur/MultiLane-v0` and `chauffeur/Intersection-v0`. An
action is (acceleration, steering) in [-1, 1], full scale as in LaMPilot, left positive; an observation is the ego and
the nearest vehicles, one row each: presence, x, y, vx, vy relative to the ego (the ego's own row is absolute), heading.
The frame is right-handed.
"""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from chauffeur.concept import Command, Observation, Scenario, ScenarioError, VehicleState
from chauffeur.control import full_scale
from chauffeur.worlds.highway.scenarios import BUILT_IN
from chauffeur.worlds.highway.world import HighwayWorld

ROWS = 10
_FEATURES = 6
_REACH_M = 1.0e4
"""Bound of every observed position, m; roads are 2.7 km long."""

FloatArray = NDArray[np.float32]


class HighwayEnvironment(gymnasium.Env[FloatArray, FloatArray]):
    """One of LaMPilot's roads. The reward is the ego's speed over the limit of its lane, and 0 from a crash on."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - gymnasium declares it so

    def __init__(self, scenario: Scenario | str, render_mode: str | None = None) -> None:
        """Make the environment.

        Args:
            scenario: A scenario, or the name of a built-in one.
            render_mode: Only None; `chauffeur.drive` shows a drive.
        """
        if isinstance(scenario, str):
            found = next((s for s in BUILT_IN if s.id == scenario), None)
            if found is None:
                raise ScenarioError(
                    f"Unknown scenario {scenario!r}.", hint="Run `chauffeur show scenarios` for the list."
                )
            scenario = found
        self.render_mode = render_mode
        self._scenario = scenario
        self._world = HighwayWorld()
        low = np.full((ROWS, _FEATURES), -_REACH_M, dtype=np.float32)
        self.observation_space = spaces.Box(low, -low, dtype=np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, shape=(2,), dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Start a trip; without a seed the generator of the environment draws one."""
        super().reset(seed=seed, options=options)
        observation = self._world.reset(self._scenario, int(self.np_random.integers(2**31)))
        return _features(observation), _info(observation)

    def step(self, action: FloatArray) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Advance 0.1 s."""
        actuation = self._world.actuation
        acceleration, steering = float(action[0]), float(action[1])
        self._world.step(
            Command(
                full_scale(acceleration, actuation.max_acceleration_mps2),
                full_scale(steering, actuation.max_steering_rad),
            )
        )
        observation = self._world.observe()
        failed = observation.ego.crashed or observation.off_road
        limit = self._world.perception().speed_limit(self._world.perception().lane_of(0))
        reward = 0.0 if failed else min(1.0, max(0.0, observation.ego.speed_mps / limit))
        return _features(observation), reward, failed, observation.ended and not failed, _info(observation)


def _row(vehicle: VehicleState, origin: VehicleState | None) -> list[float]:
    vx = vehicle.speed_mps * math.cos(vehicle.heading_rad)
    vy = vehicle.speed_mps * math.sin(vehicle.heading_rad)
    if origin is None:
        return [1.0, vehicle.x_m, vehicle.y_m, vx, vy, vehicle.heading_rad]
    ox = origin.speed_mps * math.cos(origin.heading_rad)
    oy = origin.speed_mps * math.sin(origin.heading_rad)
    return [1.0, vehicle.x_m - origin.x_m, vehicle.y_m - origin.y_m, vx - ox, vy - oy, vehicle.heading_rad]


def _features(observation: Observation) -> FloatArray:
    ego = observation.ego
    nearest = sorted(observation.others, key=lambda v: math.hypot(v.x_m - ego.x_m, v.y_m - ego.y_m))
    rows = [_row(ego, None), *(_row(v, ego) for v in nearest[: ROWS - 1])]
    features = np.zeros((ROWS, _FEATURES), dtype=np.float32)
    features[: len(rows)] = np.clip(rows, -_REACH_M, _REACH_M)
    return features


def _info(observation: Observation) -> dict[str, Any]:
    return {"time_s": observation.time_s, "speed_mps": observation.ego.speed_mps, "crashed": observation.ego.crashed}


for _name, _scenario in (("RampMerge", "overtake"), ("MultiLane", "emergency-lane"), ("Intersection", "intersection")):
    gymnasium.register(
        id=f"chauffeur/{_name}-v0",
        entry_point="chauffeur.worlds.highway.gym:HighwayEnvironment",
        kwargs={"scenario": _scenario},
    )
