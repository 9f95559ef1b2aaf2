"""The parts that stepped worlds share: the instant shown, commands and configurations as they come from outside."""

from __future__ import annotations

import math
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from chauffeur.concept import Command, Observation, Scenario, ScenarioError

Config = TypeVar("Config", bound=BaseModel)


class ShownWorld:
    """A world that looks once an instant; heirs forget `_shown` whenever something has moved."""

    _shown: Observation | None = None

    def observe(self) -> Observation:
        """The present instant as frozen values."""
        if self._shown is None:
            self._shown = self._look()
        return self._shown

    @property
    def ended(self) -> bool:
        """Crash, off the road, at the goal, or out of time."""
        return self.observe().ended

    def _look(self) -> Observation:
        raise NotImplementedError


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
