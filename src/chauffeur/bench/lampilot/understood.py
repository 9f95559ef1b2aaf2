"""Who judges a trip on a highway world: LaMPilot's referee where the scenario brings a goal, else the wish itself.

An official sample's own goal alone decides there. A free drive ends when what was understood is done and held
(`drive/fulfilment.py`); LaMPilot's scores are measured along the way, its success conditions are not.
"""

from __future__ import annotations

from chauffeur.bench.lampilot.metrics import metrics_of
from chauffeur.bench.lampilot.referee import LampilotReferee
from chauffeur.bench.lampilot.signals import SignalLog
from chauffeur.concept import JudgedBy, Metric, Outcome, Plan, ProgramState, Scenario, Setpoints
from chauffeur.drive.episode import Referee
from chauffeur.drive.fulfilment import Fulfilment, can_be_judged
from chauffeur.worlds.base import World
from chauffeur.worlds.highway import HighwayWorld


def referee_for(world: World, scenario: Scenario, plan: Plan, wish: str = "") -> Referee | None:
    """Judge of a trip; None where neither words nor plan say what was to be done.

    Raises:
        ScenarioError: The scenario's own goal cannot be judged.
    """
    if not isinstance(world, HighwayWorld):
        return None
    if scenario.goal:
        return LampilotReferee(world, scenario)
    return ScoredFulfilment(world, plan, wish) if can_be_judged(plan, wish) else None


class ScoredFulfilment:
    """The referee of a free drive, with LaMPilot's scores beside it."""

    def __init__(self, world: HighwayWorld, plan: Plan, wish: str) -> None:
        self._road = world.perception()
        self._log = SignalLog(self._road)
        self._wish = Fulfilment(world, plan, wish)

    def follow(self, setpoints: Setpoints, state: ProgramState) -> None:
        """What the policy asks for in this control period."""
        self._wish.follow(setpoints, state)

    def observe(self) -> None:
        """Look at the instant after a control period."""
        self._log.observe(self._road.instant())
        self._wish.observe()

    @property
    def over(self) -> bool:
        """Whether the wish is done, or will not be."""
        return self._wish.over

    @property
    def success(self) -> bool:
        """Whether all of it is done, and holds."""
        return self._wish.success

    @property
    def shortfall(self) -> str:
        """What is missing, in words."""
        return self._wish.shortfall

    @property
    def parts_done(self) -> tuple[int, int]:
        """Parts that are done, and all of them."""
        return self._wish.parts_done

    @property
    def judged_by(self) -> JudgedBy:
        """Source of what the drive is judged by."""
        return self._wish.judged_by

    def outcome(self) -> Outcome:
        """What came of it, collisions apart."""
        return self._wish.outcome()

    def metrics(self) -> tuple[Metric, ...]:
        """What was asked for and reached; LaMPilot's scores by its own ruler."""
        scores = metrics_of({"success": self.success, "signals": self._log.signals().as_row()})
        return (*self._wish.metrics(), *scores)
