"""The judge of a trip: by the goal of its scenario, or by what its world can be judged by."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from chauffeur.concept import Parameters, Plan, Scenario, Trajectory
from chauffeur.driving.episode import Referee
from chauffeur.driving.judge.lampilot import LampilotReferee, ScoredReferee
from chauffeur.driving.judge.referee import ActsReferee
from chauffeur.driving.judge.sources import acts_for
from chauffeur.geometry import Pose
from chauffeur.geometry.road_graph import TURNS
from chauffeur.worlds.base import World
from chauffeur.worlds.highway import HighwayWorld

RED_S: Final = 90.0
"""Who drives a trajectory in a town may stand so long on the way: a light's cycle, and people."""


def referee_for(world: World, scenario: Scenario, plan: Plan, wish: str = "") -> Referee | None:
    """The judge of a trip: LaMPilot's by the scenario's own goal, else that of a free drive, else none.

    On a highway world LaMPilot's scores are measured beside a free drive; its success conditions are not.

    Raises:
        ScenarioError: The scenario's own goal cannot be judged, or there is no such spot.
    """
    if not isinstance(world, HighwayWorld):
        return _free_referee(world, scenario, plan, wish)
    if scenario.goal:
        return LampilotReferee(world, scenario)
    return _acts_referee(world, plan, wish, ScoredReferee)


def _free_referee(world: World, scenario: Scenario, plan: Plan, wish: str = "") -> Referee | None:
    """The judge of a trip without a goal of its scenario's own; None where nothing says what was to be done.

    In a parking lot, the judge of the spot that is meant; in a town, of the place that a plan leads to, which the
    planner found and the world's geometry knows; of a trajectory, of its end; else of the acts that the words mean, or
    where these are not known, of the plan's.

    Raises:
        ScenarioError: There is no such spot.
    """
    can, route = world.capabilities, plan.policy.route if isinstance(plan.policy, Parameters) else ""
    if isinstance(plan.policy, Trajectory):
        return _at_its_end(world, plan.policy) if can.places and can.turns else _on_a_street(world, plan.policy)
    if "parking" in can.roads:
        return _in_a_spot(world, route)
    if can.places:
        sent = scenario.config.get("goal") or scenario.config.get("goal_m") or (route and route not in TURNS)
        return _at_a_place(world) if sent and isinstance(plan.policy, Parameters) else _acts_referee(world, plan, wish)
    return _acts_referee(world, plan, wish) if isinstance(world, HighwayWorld) else None


def _acts_referee(
    world: World, plan: Plan, wish: str, kind: Callable[..., ActsReferee] = ActsReferee
) -> ActsReferee | None:
    """The judge of the acts that words mean, or a plan claims; None where none of them can be judged."""
    acts, judged_by = acts_for(plan, wish)
    return kind(world, acts, judged_by, settings=dict(plan.settings)) if acts else None


def _at_a_place(world: World) -> Referee | None:
    from chauffeur.worlds.town import TownReferee, TownWorld

    return TownReferee(world) if isinstance(world, TownWorld) else None


def _on_a_street(world: World, trajectory: Trajectory) -> Referee | None:
    from chauffeur.worlds.track import TrackWorld

    return _at_its_end(world, trajectory, 0.0) if isinstance(world, TrackWorld) and world.open_road else None


def _at_its_end(world: World, trajectory: Trajectory, waits_s: float = RED_S) -> Referee:
    from chauffeur.worlds.track import StreetReferee, end_of

    ego = world.observe().ego
    return StreetReferee(world, end_of(trajectory, Pose(ego.x_m, ego.y_m, ego.heading_rad)), waits_s=waits_s)


def _in_a_spot(world: World, place: str) -> Referee | None:
    from chauffeur.worlds.parking import ParkingReferee, ParkingWorld

    return ParkingReferee(world, world.spot(place)) if place and isinstance(world, ParkingWorld) else None
