"""The one door to the actuator: every command of every drive passes here, and the shield if there is one."""

from __future__ import annotations

from dataclasses import dataclass

from chauffeur.concept import Command, Intervention, LaneId, Snapshot
from chauffeur.safety.shield import Guarded, Shield
from chauffeur.worlds.base import World


@dataclass(frozen=True, slots=True)
class Actuated:
    """What was asked of the actuator, what the shield changed in it, and what the world did."""

    requested: Command
    applied: Command
    interventions: tuple[Intervention, ...] = ()


def actuate(
    world: World, snapshot: Snapshot | None, requested: Command, aim: LaneId | None, shield: Shield | None
) -> Actuated:
    """Let the world go on for a control period.

    Args:
        world: To be stepped.
        snapshot: Its present instant; a shield needs it.
        requested: What the driver, or a person at the wheel, asks for.
        aim: Lane that is steered for.
        shield: Has the last word; None where a benchmark's own rules allow none.
    """
    guarded = Guarded(requested) if shield is None or snapshot is None else shield.guard(snapshot, requested, aim)
    return Actuated(requested, world.step(guarded.command), guarded.interventions)
