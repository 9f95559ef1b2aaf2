"""Who judges a single trip, by what its world can be judged by."""

from __future__ import annotations

from typing import Final

from chauffeur.bench.lampilot.metrics import metrics_of
from chauffeur.bench.lampilot.referee import LampilotReferee
from chauffeur.bench.lampilot.signals import SignalLog
from chauffeur.concept import (
    JudgedBy,
    Metric,
    Parameters,
    Plan,
    Program,
    Scenario,
    Trajectory,
)
from chauffeur.drive.episode import Referee
from chauffeur.drive.fulfilment import Fulfilment, can_be_judged
from chauffeur.drive.realised import MeaningReferee
from chauffeur.geometry import Pose, Turn
from chauffeur.language.wanted import read_wanted
from chauffeur.safety.constant_calls import read_program
from chauffeur.worlds.base import World
from chauffeur.worlds.highway import HighwayWorld

TURN_CALLS: Final[dict[str, Turn]] = {
    "turn_left_at_next_intersection": "left",
    "turn_right_at_next_intersection": "right",
    "go_straight_at_next_intersection": "straight",
}
MEANING: Final = "meaning"
"""The planner whose acts can be judged one by one: what it goes by is the meaning of the words."""
_STOPS: Final = ("stop", "pull_over", "park")
_TURNS: Final[tuple[Turn, ...]] = ("left", "right", "straight")
RED_S: Final = 90.0
"""Who drives a trajectory in a town may stand so long on the way: a light's cycle, and people."""


def referee_for(world: World, scenario: Scenario, plan: Plan, wish: str = "") -> Referee | None:
    """The judge of a trip: LaMPilot's by the scenario's own goal, else the wish, else none. In a parking lot, the judge
    of the spot that is meant; in a town, of the place or of the ways and stops; on an open road and in a town, of a
    trajectory's end.

    Ways, sides, stops and speeds are those of the words, read by rules that see no plan; where they say none, those of
    the plan. A place is the plan's: found by the planner, reached by the world's own geometry. Of the planner that
    drives by the meaning of words, each act is judged by itself.

    Raises:
        ScenarioError: There is no such spot.
    """
    if plan.planner == MEANING and world.capabilities.places and world.capabilities.turns:
        from chauffeur.language.meaning.reader import read

        return MeaningReferee(world, read(wish).acts, "reading")
    if isinstance(plan.policy, Trajectory) and world.capabilities.turns and world.capabilities.places:
        return _end_referee(world, plan.policy, waits_s=RED_S)
    if world.capabilities.places:
        return _town_referee(world, scenario, plan, wish) or _parking_referee(world, plan)
    if isinstance(plan.policy, Trajectory):
        return _street_referee(world, plan.policy)
    return highway_referee(world, scenario, plan, wish)


def highway_referee(world: World, scenario: Scenario, plan: Plan, wish: str = "") -> Referee | None:
    """LaMPilot's judge where the scenario brings a goal, else that of the wish; None where nothing says what was to be
    done.

    An official sample's own goal alone decides there. A free drive ends when what was understood is done and held
    (`drive/fulfilment.py`); LaMPilot's scores are measured along the way, its success conditions are not.

    Raises:
        ScenarioError: The scenario's own goal cannot be judged.
    """
    if not isinstance(world, HighwayWorld):
        return None
    if scenario.goal:
        return LampilotReferee(world, scenario)
    return ScoredFulfilment(world, plan, wish) if can_be_judged(plan, wish) else None


def _town_referee(world: World, scenario: Scenario, plan: Plan, wish: str) -> Referee | None:
    from chauffeur.worlds.town import TownReferee, TownWay, TownWorld, WayReferee

    if not isinstance(world, TownWorld):
        return None
    acts = [part for part in read_wanted(wish) if part.kind == "act" and not part.denied]
    said = [TownWay(part.side, part.nth) for part in acts if part.act == "turn" and part.side]
    stands = any(part.act in _STOPS for part in acts)
    judged_by: JudgedBy = "words" if said or stands else "plan"
    if isinstance(plan.policy, Program):
        calls = [use.name for use in read_program(plan.policy.source).uses]
        ways = said or [TownWay(TURN_CALLS[name]) for name in calls if name in TURN_CALLS]
        if ways or stands or "stop" in calls:
            return WayReferee(world, ways, stops=stands or "stop" in calls, judged_by=judged_by)
        return None  # nothing that could be over
    if isinstance(plan.policy, Parameters) and not (scenario.config.get("goal") or scenario.config.get("goal_m")):
        if plan.policy.route in _TURNS:
            ways = said or [TownWay(turn) for turn in _TURNS if turn == plan.policy.route]
            return WayReferee(world, ways, stops=False, judged_by=judged_by)
        if not plan.policy.route and plan.policy.target_speed_mps <= 0.0:
            return WayReferee(world, (), stops=True, judged_by=judged_by)
        if not plan.policy.route:
            return Fulfilment(world, plan, wish) if can_be_judged(plan, wish) else None
    return TownReferee(world)


def _street_referee(world: World, trajectory: Trajectory) -> Referee | None:
    from chauffeur.worlds.track import TrackWorld

    return _end_referee(world, trajectory) if isinstance(world, TrackWorld) and world.open_road else None


def _end_referee(world: World, trajectory: Trajectory, waits_s: float = 0.0) -> Referee:
    from chauffeur.worlds.track import StreetReferee, end_of

    ego = world.observe().ego
    return StreetReferee(world, end_of(trajectory, Pose(ego.x_m, ego.y_m, ego.heading_rad)), waits_s=waits_s)


def _parking_referee(world: World, plan: Plan) -> Referee | None:
    from chauffeur.worlds.parking import ParkingReferee, ParkingWorld

    place = plan.policy.route if isinstance(plan.policy, Parameters) else ""
    return ParkingReferee(world, world.spot(place)) if place and isinstance(world, ParkingWorld) else None


class ScoredFulfilment(Fulfilment):
    """The referee of a free drive, with LaMPilot's scores beside it."""

    def __init__(self, world: HighwayWorld, plan: Plan, wish: str) -> None:
        super().__init__(world, plan, wish)
        self._view = world.perception()
        self._log = SignalLog(self._view)

    def observe(self) -> None:
        """Look at the instant after a control period."""
        self._log.observe(self._view.instant())
        super().observe()

    def metrics(self) -> tuple[Metric, ...]:
        """What was asked for and reached; LaMPilot's scores by its own ruler."""
        scores = metrics_of({"success": self.success, "signals": self._log.signals().as_row()})
        return (*super().metrics(), *scores)
