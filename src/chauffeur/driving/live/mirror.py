"""Another process's own copy of the world, kept at the newest instant that control has shown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from chauffeur.concept import DataError, Limits, Scenario, ScenarioError
from chauffeur.concept.registry import load_plugin
from chauffeur.driving.live.messages import MessageError, MirroredInstant
from chauffeur.driving.live.ring import Ring
from chauffeur.driving.live.starts import Start
from chauffeur.worlds.base import MirroredWorld, World, WorldMirror


def live_world(scenario: Scenario) -> MirroredWorld:
    """A fresh world to drive in in real time. Raises ScenarioError where other processes cannot follow it."""
    world: World = load_plugin("chauffeur.worlds", scenario.world)()
    # isinstance would read the properties of a world that has not been reset.
    if not hasattr(world, "mirror"):
        raise ScenarioError(
            f"{scenario.title or scenario.id} cannot be driven in real time: the world {scenario.world!r} does "
            "not show its present instant to other processes.",
            hint=f'Drive it in simulated time: chauffeur drive "WISH" --scenario {scenario.id}. Or talk on a highway, '
            "at a crossing, in a parking lot or in a town: chauffeur show scenarios.",
        )
    return cast("MirroredWorld", world)


def mirror_of(scenario: Scenario) -> WorldMirror:
    """A copy to look on with. Raises ScenarioError as `live_world`."""
    return live_world(scenario).mirror()


class Mirror:
    """A world that nobody steps: it follows what control shows."""

    def __init__(self, world: WorldMirror, starts: Sequence[Start], observations: Ring) -> None:
        self.world = world
        self._starts, self._observations = starts, observations
        self._seen = 0
        self.trip = 0
        self.tick = 0
        self.handovers = 0
        """How often the wheel has changed hands: odd while the person has it."""

    @property
    def start(self) -> Start:
        """Of the present trip."""
        return self._starts[self.trip - 1]

    @property
    def limits(self) -> Limits:
        """Of the present trip."""
        return self.start.limits

    def follow(self) -> bool:
        """Be at the newest instant; False where there is no newer one, or what is there is none."""
        message = self._observations.latest()
        if message is None or message.number == self._seen:
            return False
        self._seen = message.number
        try:
            shown = MirroredInstant.decode(message.payload)
            if not 1 <= shown.trip <= len(self._starts):
                return False
            if shown.trip != self.trip:
                start = self._starts[shown.trip - 1]
                self.world.reset(start.scenario, start.seed)
            self.world.adopt(shown.world)
        except (MessageError, DataError):
            return False
        self.trip, self.tick, self.handovers = shown.trip, shown.tick, shown.handovers
        return True
