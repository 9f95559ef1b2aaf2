"""Referees of a single trip: LaMPilot's goal where a scenario brings one, else the judge of free drives."""

from __future__ import annotations

from typing import Any

from chauffeur.bench.lampilot.metrics import metrics_of
from chauffeur.bench.lampilot.referee import LampilotReferee
from chauffeur.bench.lampilot.signals import SignalLog
from chauffeur.concept import Metric, Plan, Scenario
from chauffeur.driving.episode import Referee
from chauffeur.driving.judge.choice import acts_referee, free_referee
from chauffeur.driving.judge.referee import ActsReferee
from chauffeur.worlds.base import World
from chauffeur.worlds.highway import HighwayWorld


def referee_for(world: World, scenario: Scenario, plan: Plan, wish: str = "") -> Referee | None:
    """The judge of a trip: LaMPilot's by the scenario's own goal, else that of a free drive, else none.

    On a highway world LaMPilot's scores are measured beside a free drive; its success conditions are not.

    Raises:
        ScenarioError: The scenario's own goal cannot be judged, or there is no such spot.
    """
    if not isinstance(world, HighwayWorld):
        return free_referee(world, scenario, plan, wish)
    if scenario.goal:
        return LampilotReferee(world, scenario)
    return acts_referee(world, plan, wish, ScoredReferee)


class ScoredReferee(ActsReferee):
    """The referee of a free drive, with LaMPilot's scores beside it."""

    def __init__(self, world: HighwayWorld, *task: Any, **options: Any) -> None:
        super().__init__(world, *task, **options)
        self._view = world.perception()
        self._log = SignalLog(self._view)

    def observe(self) -> None:
        """Look at the instant after a control period."""
        self._log.observe(self._view.instant())
        super().observe()

    def metrics(self) -> tuple[Metric, ...]:
        """Goals asked for and reached; LaMPilot's scores by its own ruler."""
        scores = metrics_of({"success": self.success, "signals": self._log.signals().as_row()})
        return (*super().metrics(), *scores)
