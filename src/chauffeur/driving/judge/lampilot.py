"""LaMPilot's judge on highway worlds: the goal of a scenario, and its scores beside the judge of a free drive."""

from __future__ import annotations

from typing import Any, Protocol

from chauffeur.concept import Metric, Outcome, Scenario
from chauffeur.driving.judge.goals import Goal, Ruling, make_goal
from chauffeur.driving.judge.metrics import metrics_of
from chauffeur.driving.judge.referee import ActsReferee
from chauffeur.driving.judge.signals import SignalLog, Signals
from chauffeur.worlds.highway import HighwayWorld, RoadPerception


class HasRoad(Protocol):
    """A world whose perception goals and scores can read: the compiled one or the reference."""

    def perception(self) -> RoadPerception: ...


class GoalJudge:
    """Judge of a goal alone, without scores; heirs say how they look at an instant."""

    def __init__(self, road: RoadPerception, goal: Goal) -> None:
        self._road = road
        self._goal = goal
        self._ruling: Ruling = "open"

    @property
    def over(self) -> bool:
        """True once the goal is decided."""
        return self._ruling != "open"

    @property
    def success(self) -> bool:
        """LaMPilot's success flag, independent of its collision flag."""
        return self._ruling == "success"

    @property
    def collided(self) -> bool:
        """LaMPilot's collision flag: crashed, or off the road."""
        now = self._road.instant()
        return now.crashed or not now.on_road

    def outcome(self) -> Outcome:
        """Outcome, collisions apart. A goal that is never decided is a timeout: time or road ran out."""
        return "success" if self.success else "failure" if self._ruling == "failure" else "timeout"

    def metrics(self) -> tuple[Metric, ...]:
        """None: nothing is scored here."""
        return ()


class LampilotReferee(GoalJudge):
    """Referee of one episode; make it right after the world was reset."""

    def __init__(self, world: HasRoad, scenario: Scenario) -> None:
        road = world.perception()
        super().__init__(road, make_goal(road, scenario))
        self._log = SignalLog(road)

    def observe(self) -> None:
        """Look at the instant after a control period."""
        now = self._road.instant()
        self._log.observe(now)
        self._ruling = self._goal.rule(self._log.steps / 10, now)

    def outcome(self) -> Outcome:
        """Outcome. A goal reached in the instant of a collision is a collision."""
        now = self._road.instant()
        return "collision" if now.crashed else "off_road" if not now.on_road else super().outcome()

    def signals(self) -> Signals:
        """Signals for the scores, so far."""
        return self._log.signals()

    def metrics(self) -> tuple[Metric, ...]:
        """Scores so far, by LaMPilot's own ruler."""
        row: dict[str, Any] = {"success": self.success, "signals": self.signals().as_row()}
        return metrics_of(row)


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
