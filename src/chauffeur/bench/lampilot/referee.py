"""Judges an episode on a highway world: goal, collision, scores. It watches and never acts."""

from __future__ import annotations

from chauffeur.bench.lampilot.goals import Ruling, make_goal
from chauffeur.bench.lampilot.metrics import Scorer
from chauffeur.concept import Metric, Outcome, Scenario
from chauffeur.worlds.highway import HighwayWorld


class LampilotReferee:
    """Referee of one episode; make it right after the world was reset."""

    def __init__(self, world: HighwayWorld, scenario: Scenario) -> None:
        self._world = world
        self._goal = make_goal(world, scenario)
        self._scorer = Scorer()
        self._ruling: Ruling = "open"

    def observe(self) -> None:
        """Look at the instant after a control period."""
        scene = self._world.scene
        self._scorer.observe(scene.ego, scene.road.vehicles)
        self._ruling = self._goal.rule(len(self._scorer.speeds_mps) / 10)

    @property
    def over(self) -> bool:
        """Whether the goal is decided."""
        return self._ruling != "open"

    @property
    def collided(self) -> bool:
        """LaMPilot's collision flag: crashed, or off the road."""
        ego = self._world.scene.ego
        return bool(ego.crashed or not ego.on_road)

    def outcome(self) -> Outcome:
        """What happened. A goal reached in the instant of a collision is a collision; one never decided, a timeout:
        time or road ran out."""
        ego = self._world.scene.ego
        if ego.crashed:
            return "collision"
        if not ego.on_road:
            return "off_road"
        if self._ruling == "success":
            return "success"
        return "failure" if self._ruling == "failure" else "timeout"

    @property
    def success(self) -> bool:
        """LaMPilot's success flag, independent of its collision flag."""
        return self._ruling == "success"

    def metrics(self) -> tuple[Metric, ...]:
        """Scores so far."""
        return self._scorer.metrics(success=self.success)
