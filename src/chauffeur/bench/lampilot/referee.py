"""Judges an episode on a highway world: goal, collision, signals for the scores. It watches and never acts."""

from __future__ import annotations

from typing import Any, Protocol

from chauffeur.bench.lampilot.goals import Ruling
from chauffeur.bench.lampilot.goals_more import make_any_goal
from chauffeur.bench.lampilot.metrics import metrics_of
from chauffeur.bench.lampilot.signals import SignalLog, Signals
from chauffeur.concept import Metric, Outcome, Scenario
from chauffeur.worlds.highway import RoadPerception


class HasRoad(Protocol):
    """A world whose perception goals and scores can read: the compiled one or the reference."""

    def perception(self) -> RoadPerception: ...


class LampilotReferee:
    """Referee of one episode; make it right after the world was reset."""

    def __init__(self, world: HasRoad, scenario: Scenario) -> None:
        self._road = world.perception()
        self._goal = make_any_goal(self._road, scenario)
        self._log = SignalLog(self._road)
        self._ruling: Ruling = "open"

    def observe(self) -> None:
        """Look at the instant after a control period."""
        now = self._road.instant()
        self._log.observe(now)
        self._ruling = self._goal.rule(self._log.steps / 10, now)

    @property
    def over(self) -> bool:
        """Whether the goal is decided."""
        return self._ruling != "open"

    @property
    def collided(self) -> bool:
        """LaMPilot's collision flag: crashed, or off the road."""
        now = self._road.instant()
        return now.crashed or not now.on_road

    def outcome(self) -> Outcome:
        """What happened. A goal reached in the instant of a collision is a collision; one never decided, a timeout:
        time or road ran out."""
        now = self._road.instant()
        if now.crashed:
            return "collision"
        if not now.on_road:
            return "off_road"
        if self._ruling == "success":
            return "success"
        return "failure" if self._ruling == "failure" else "timeout"

    @property
    def success(self) -> bool:
        """LaMPilot's success flag, independent of its collision flag."""
        return self._ruling == "success"

    def signals(self) -> Signals:
        """What the scores are made of, so far."""
        return self._log.signals()

    def metrics(self) -> tuple[Metric, ...]:
        """Scores so far, by LaMPilot's own ruler."""
        row: dict[str, Any] = {"success": self.success, "signals": self.signals().as_row()}
        return metrics_of(row)
