"""The one door to the actuator: every command of every drive passes here, and the shield if there is one.

What the world's driver is asked for passes here as well (`set_points`): limits hold whoever wished.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from chauffeur.concept import Command, Intervention, LaneId, Limits, Observation, Setpoints
from chauffeur.safety.bounds import bounded
from chauffeur.safety.shield import FilterResult, Shield
from chauffeur.worlds.base import World


@dataclass(frozen=True, slots=True)
class Actuated:
    """What was asked of the actuator, what the shield changed in it, and what the world did."""

    requested: Command
    applied: Command
    interventions: tuple[Intervention, ...] = ()


def set_points(
    world: World, observation: Observation, setpoints: Setpoints, limits: Limits, least_mps: float = 0.0
) -> tuple[Setpoints, tuple[str, ...]]:
    """The set-points as they may be driven at an instant, and the names of what was brought within the limits.

    Args:
        world: Whose speed limits hold: that of the lane the car is in; in a lane change, the higher one of both.
        observation: Its present instant.
        setpoints: As the policy states them.
        limits: Of the person and the operator.
        least_mps: Least speed a policy may ask for there; 0 for none.
    """
    perception = world.perception()
    lanes = [lane for lane in (observation.ego.lane, setpoints.target_lane) if lane is not None]
    return bounded(setpoints, limits, max(map(perception.speed_limit, lanes), default=math.inf), least_mps)


def actuate(
    world: World, observation: Observation | None, requested: Command, aim: LaneId | None, shield: Shield | None
) -> Actuated:
    """Let the world go on for a control period.

    Args:
        world: To be stepped.
        observation: Its present instant; a shield needs it.
        requested: What the driver, or a person at the wheel, asks for.
        aim: Lane that is steered for.
        shield: Has the last word; None where a benchmark's own rules allow none.
    """
    guarded = (
        FilterResult(requested) if shield is None or observation is None else shield.filter(observation, requested, aim)
    )
    return Actuated(requested, world.step(guarded.command), guarded.interventions)
