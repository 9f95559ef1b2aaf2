"""The conformance kit: the built-in worlds and the example pass it, and what breaks the contract is found."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from world_contract import WorldContract

from chauffeur.concept import Command, Observation, Scenario, ScenarioError
from chauffeur.concept.registry import load_plugin
from chauffeur.driving.episode import make_world
from chauffeur.driving.scenarios import BUILT_IN
from chauffeur.geometry import Polyline, RoadGraph
from chauffeur.worlds.conformance import MakeWorld, check_world
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.route import RouteWorld

SCENES = {scenario.id: scenario for scenario in BUILT_IN}


def faults(make: Callable[[], Any], scenario: Scenario) -> dict[str, tuple[str, ...]]:
    return {found.check: found.faults for found in check_world(make, scenario) if found.faults}


class TestBuiltInWorlds(WorldContract):
    @pytest.fixture(params=BUILT_IN, ids=lambda scenario: scenario.id)
    def tried(self, request: pytest.FixtureRequest) -> tuple[MakeWorld, Scenario]:
        scenario: Scenario = request.param
        pytest.importorskip({"town": "libsumo", "track": "vehiclemodels"}.get(scenario.world, "math"))
        return lambda: make_world(scenario), scenario


@pytest.mark.parametrize("world", sorted({scenario.world for scenario in BUILT_IN}))
@pytest.mark.parametrize("ask", ["observe", "perception", "driver"])
def test_before_the_first_reset_a_built_in_world_says_what_is_missing(world: str, ask: str) -> None:
    with pytest.raises(ScenarioError, match="no scenario"):
        getattr(load_plugin("chauffeur.worlds", world)(), ask)()


class TestTheExample(WorldContract):
    @pytest.fixture
    def tried(self, monkeypatch: pytest.MonkeyPatch) -> tuple[MakeWorld, Scenario]:
        monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "examples"))
        return importlib.import_module("one_lane").OneLane, Scenario("one-lane", "one-lane", {}, 0)


class _Forgetful(HighwayWorld):
    """Whoever observes it changes it."""

    looks = 0

    def observe(self) -> Observation:
        _Forgetful.looks += 1
        return replace(super().observe(), time_s=float(_Forgetful.looks))


class _Wild(HighwayWorld):
    def step(self, command: Command) -> Command:
        super().step(Command(0.0, 0.0))
        return command


class _Torn(HighwayWorld):
    def observe(self) -> Observation:
        shown = super().observe()
        first, *rest = shown.road.lanes
        return replace(shown, road=RoadGraph((replace(first, successors=("nowhere",)), *rest)))


class _Immortal(HighwayWorld):
    ended = False  # type: ignore[assignment]


class _Modest(HighwayWorld):
    capabilities = replace(HighwayWorld.capabilities, lane_changes=False, policies=())


class _Mirrored(HighwayWorld):
    """As in highway-env: y, headings and steering to the right."""

    def observe(self) -> Observation:
        shown = super().observe()
        lanes = (
            replace(lane, centre=Polyline.of((x, -y) for x, y in lane.centre.points_m)) for lane in shown.road.lanes
        )
        return replace(shown, road=RoadGraph(tuple(lanes)))

    def step(self, command: Command) -> Command:
        applied = super().step(replace(command, steering_rad=-command.steering_rad))
        return replace(applied, steering_rad=-applied.steering_rad)


class _Broken(HighwayWorld):
    def driver(self) -> Any:
        raise RuntimeError("no driver today")


@pytest.mark.parametrize(
    ("world", "check", "says"),
    [
        (_Forgetful, "same seed, same trip", "differs at tick 0"),
        (_Forgetful, "time", "Two looks"),
        (_Wild, "commands", "was applied as"),
        (_Wild, "commands", "ValueError"),
        (_Torn, "road graph", "nowhere, which is no lane"),
        (_Torn, "observations are frozen", "another object"),
        (_Mirrored, "right-handed", "lies to its left"),
        (_Mirrored, "right-handed", "turned to the right"),
        (_Immortal, "the end", "the trip goes on"),
        (_Modest, "capabilities", "lanes abreast"),
        (_Modest, "capabilities", "no kind of policy"),
        (_Broken, "driver", "RuntimeError: no driver today"),
    ],
)
def test_what_breaks_it_is_found_and_named(world: type[HighwayWorld], check: str, says: str) -> None:
    found = faults(world, SCENES["overtake"])[check]
    assert any(says in fault for fault in found), found


class TestARoute(WorldContract):
    @pytest.fixture
    def tried(self) -> tuple[MakeWorld, Scenario]:
        way = [[-20.0, 0.0], [50.0, 0.0], [100.0, 10.0], [200.0, 60.0]]
        config = {"route": way, "speed_mps": 8.0, "agents": [{"x_m": 60.0, "y_m": 2.0, "speed_mps": 3.0}]}
        return RouteWorld, Scenario("a-route", "route", config, 0)


@pytest.mark.parametrize("route", [[[0.0, 0.0], [0.0, 0.0]], [[0.0, 0.0]], [[0.0, float("nan")], [1.0, 0.0]], "road"])
def test_a_route_that_leads_nowhere_is_refused(route: object) -> None:
    with pytest.raises(ScenarioError):
        RouteWorld().reset(Scenario("none", "route", {"route": route}, 0))
