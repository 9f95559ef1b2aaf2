"""Base of stepped worlds: observation, perception and driver of a trip; validation of commands and configurations."""

from __future__ import annotations

import math
from typing import Final, Generic, TypeVar

from pydantic import BaseModel, ValidationError

from chauffeur.concept import Command, JudgedBy, Observation, Outcome, Scenario, ScenarioError, WishPart

Config = TypeVar("Config", bound=BaseModel)
PerceptionT = TypeVar("PerceptionT")
DriverT = TypeVar("DriverT")
SetUp = TypeVar("SetUp")


class WorldBase(Generic[PerceptionT, DriverT]):
    """A world that looks once an instant.

    Heirs set `_perception` and `_driver` at a reset, and forget `_shown` whenever something has moved.
    """

    _shown: Observation | None = None
    _perception: PerceptionT | None = None
    _driver: DriverT | None = None

    def observe(self) -> Observation:
        """The present instant as frozen values."""
        if self._shown is None:
            self._shown = self._look()
        return self._shown

    @property
    def ended(self) -> bool:
        """Crash, off the road, at the goal, or out of time."""
        return self.observe().ended

    def perception(self) -> PerceptionT:
        """Questions about the present instant. Raises ScenarioError before the first reset."""
        return set_up(self._perception)

    def driver(self) -> DriverT:
        """The low-level driver of the trip, the same until the next reset. Raises ScenarioError before the first."""
        return set_up(self._driver)

    def _look(self) -> Observation:
        raise NotImplementedError


def set_up(part: SetUp | None) -> SetUp:
    """A part that a reset makes. Raises ScenarioError: there was none yet."""
    if part is None:
        raise ScenarioError("The world has no scenario yet.", hint="Call reset(scenario) first.")
    return part


def finite(command: Command) -> Command:
    """The command. Raises ValueError: it is not made of finite numbers."""
    if not (math.isfinite(command.acceleration_mps2) and math.isfinite(command.steering_rad)):
        raise ValueError(f"A command must be finite numbers, not {command}.")
    return command


def config_of(model: type[Config], scenario: Scenario, kind: str) -> Config:
    """A scenario's configuration. Raises ScenarioError: it is malformed; the message names its kind and all faults."""
    try:
        return model.model_validate(scenario.config)
    except ValidationError as error:
        faults = "; ".join(f"{'.'.join(map(str, e['loc'])) or 'config'}: {e['msg']}" for e in error.errors())
        raise ScenarioError(
            f"Scenario {scenario.id!r} has a bad {kind} configuration: {faults}.",
            hint="Compare it with a built-in one: chauffeur show scenarios.",
        ) from error


class PlaceJudge:
    """Judge of a trip whose end is a place: the car is there, or it is not. Heirs say when it is over and done."""

    judged_by: Final[JudgedBy] = "place"

    @property
    def over(self) -> bool:
        """True if the trip is decided."""
        raise NotImplementedError

    @property
    def success(self) -> bool:
        """True if the car is where it was to be."""
        raise NotImplementedError

    @property
    def parts(self) -> tuple[WishPart, ...]:
        """The one thing asked for: to be there."""
        why = "" if self.success else "the car stands elsewhere" if self.over else "the car did not get there"
        return (WishPart("done" if self.success else "not_done", why=why),)

    def outcome(self) -> Outcome:
        """Outcome of the trip, collisions apart."""
        return "success" if self.success else "failure" if self.over else "timeout"
