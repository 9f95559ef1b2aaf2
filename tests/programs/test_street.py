"""Town calls: answers, wishes, and which kind of road understands them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest
from straight_road import StraightRoad

from chauffeur.concept import Command, Observation, Setpoints, VehicleState
from chauffeur.programs import ProgramExecutor, check_source, render_docs
from chauffeur.programs.catalogue import APIS, NOTHING_AHEAD_M, TOWN_APIS, TOWN_CALLS, vocabulary_of
from chauffeur.programs.executor import TickResult

DRIVE = "def go():\n    {first}\n    while True:\n        yield proceed(check_speed_limit())\n"


@dataclass
class Street:
    """A perception with lights, people, junctions and places; the rest is of a straight road."""

    road: StraightRoad
    gap: tuple[float, float] | None = (6.8, 0.0)
    light: tuple[str, float] | None = ("red", 23.0)
    person: float | None = None
    junction: tuple[float, tuple[str, ...]] | None = (40.0, ("left", "straight"))
    places: dict[str, float] = field(default_factory=lambda: {"church": 120.0})
    seen: Any = None
    users: dict[int, VehicleState] = field(default_factory=dict[int, VehicleState])
    where: dict[int, tuple[float, float, float]] = field(default_factory=dict[int, tuple[float, float, float]])
    crossing: dict[int, float] = field(default_factory=dict[int, float])
    turned: dict[int, str] = field(default_factory=dict[int, str])
    lanes: dict[int, str] = field(default_factory=dict[int, str])

    def __getattr__(self, name: str) -> object:
        return getattr(self.road.perception(), name)

    def gap_ahead(self) -> tuple[float, float] | None:
        return self.gap

    def light_ahead(self) -> tuple[str, float] | None:
        return self.light

    def person_ahead(self) -> float | None:
        return self.person

    def junction_ahead(self) -> tuple[float, tuple[str, ...]] | None:
        return self.junction

    def lane_beside(self, side: int) -> str | None:
        return self.road.perception().adjacent_lane(self.road.perception().lane_of(0), side)

    def place_ahead(self, name: str) -> float | None:
        return self.places.get(name)

    def look(self) -> Observation:
        return self.seen

    def vehicle(self, number: int) -> VehicleState:
        return self.road.perception().vehicle(number) if number == 0 else self.users[number]

    def on_way(self, number: int) -> tuple[float, float, float]:
        return self.where[self.vehicle(number).id]

    def crosses_at(self, number: int) -> float | None:
        return self.crossing.get(number)

    def turn_after(self, number: int) -> str | None:
        return self.turned.get(number)

    def lane_after(self, number: int) -> str | None:
        return self.lanes.get(number)

    def is_clear(self) -> bool:
        return True


class Town:
    """A world whose perception is a street's."""

    def __init__(self) -> None:
        self.road = StraightRoad()
        self.street = Street(self.road)

    def perception(self) -> Street:
        return self.street

    def driver(self) -> Town:
        return self

    def settle(self, setpoints: Setpoints) -> Setpoints:
        return setpoints

    def command(self, setpoints: Setpoints) -> Command:
        raise AssertionError(f"stop and proceed ask no driver: {setpoints}")


@pytest.fixture(scope="module")
def executor() -> Iterator[ProgramExecutor]:
    with ProgramExecutor() as one:
        yield one


def test_the_papers_program_drives_in_a_town(executor: ProgramExecutor) -> None:
    source = """
def start_driving_with_front_vehicle_check():
    while True:
        (is_front_vehicle, distance_to_front_vehicle, speed_of_front_vehicle) = check_front_vehicle()
        if (is_front_vehicle and distance_to_front_vehicle < 5 and speed_of_front_vehicle == 0.0):
            yield stop()
        else:
            speed_limit = check_speed_limit()
            yield proceed(speed_limit)
"""
    town = Town()
    assert executor.start(source, town) == "running"  # type: ignore[arg-type]
    limit = town.road.perception().speed_limit(town.road.perception().lane_of(0))
    assert executor.tick().setpoints.target_speed_mps == limit
    town.street.gap = (3.0, 0.0)
    assert executor.tick().setpoints.target_speed_mps == 0.0
    town.street.gap = None
    assert executor.tick().setpoints.target_speed_mps == limit


def test_what_is_asked_is_answered(executor: ProgramExecutor) -> None:
    asked = (
        "check_traffic_light()", "check_stop_sign()", "check_people()", "get_distance_to_junction()",
        'can_go("left")', 'can_go("right")', 'get_distance_to_place("church")', 'get_distance_to_place("moon")',
    )  # fmt: skip
    source = "def go():\n" + "".join(f"    say(str({one}))\n    yield\n" for one in asked)
    assert executor.start(source, Town()) == "running"  # type: ignore[arg-type]
    said = [executor.tick().said[0] for _ in asked]
    nothing, sign = f"(False, {NOTHING_AHEAD_M})", "(True, 300.0)"
    assert said == ["('red', 23.0)", sign, nothing, "40.0", "True", "False", "120.0", "-1.0"]


def test_a_lane_that_is_not_there_is_said(executor: ProgramExecutor) -> None:
    town = Town()
    lanes = {side: town.road.perception().adjacent_lane(town.road.perception().lane_of(0), side) for side in (-1, 1)}
    source = "def go():\n    say(str([change_lane_left(), change_lane_right()]))\n    yield stop()\n"
    assert executor.start(source, town) == "running"  # type: ignore[arg-type]
    tick = executor.tick()
    assert tick.said == (str([lanes[-1] is not None, lanes[1] is not None]),)
    assert tick.setpoints.target_speed_mps == 0.0


def test_roads_know_none_of_it(executor: ProgramExecutor) -> None:
    source = DRIVE.format(first="pass")
    assert not check_source(source).passed
    assert check_source(source, vocabulary="town").passed
    assert executor.start(source, StraightRoad()) == "failed"
    own = "def go():\n    stop = 3\n    proceed = stop\n    while proceed:\n        yield autopilot()\n"
    assert check_source(own).passed
    assert executor.start(own, StraightRoad()) == "running"
    assert executor.tick().state == "running"
    assert not check_source(own, vocabulary="town").passed


def test_programs_of_roads_are_programs_of_towns() -> None:
    assert APIS.items() <= TOWN_APIS.items()
    assert {api.name for api in TOWN_CALLS}.isdisjoint(APIS)
    assert (vocabulary_of("town"), vocabulary_of("highway"), vocabulary_of("intersection")) == ("town", "road", "road")
    for api in TOWN_CALLS:
        assert api.signature in render_docs("town")
        assert api.signature not in render_docs()
        example = api.example.replace("...", "pass")
        assert check_source(f"def go():\n    {example}\n    yield\n", vocabulary="town").passed, api.name


# Road users -----------------------------------------------------------------------------------------------------------


def car(number: int, kind: str = "car", speed: float = 0.0) -> VehicleState:
    return VehicleState(number, kind, 0.0, 0.0, 0.0, speed, 4.6, 1.8, None)  # type: ignore[arg-type]


def ticked(executor: ProgramExecutor, town: Town, body: str) -> TickResult:
    """The first control period of a program about road user 17."""
    assert executor.start(f"def go():\n    who = agent(17)\n    {body}\n", town) == "running"  # type: ignore[arg-type]
    return executor.tick()


@pytest.fixture
def town() -> Town:
    one = Town()
    one.street.users[17] = car(17)
    one.street.where[17] = (30.0, -2.8, 0.0)
    return one


def test_a_road_user_is_named_by_its_number(executor: ProgramExecutor, town: Town) -> None:
    assert ticked(executor, town, "say(str([who is None, agent(18) is None, in_sight(who)]))\n    yield").said == (
        "[False, True, True]",
    )


@pytest.mark.parametrize("made_up", ['stop_behind("veh:17")', "stop_behind(17)", 'see("dragon", "", "", "")'])
def test_a_made_up_road_user_is_refused(executor: ProgramExecutor, town: Town, made_up: str) -> None:
    source = f"def go():\n    yield {made_up}\n"
    if executor.start(source, town) == "running":  # type: ignore[arg-type]
        assert executor.tick().state == "failed"


@pytest.mark.parametrize("call", ["behind", "beside", "beyond"])
def test_it_stands_where_it_is_told_to(executor: ProgramExecutor, town: Town, call: str) -> None:
    """The set-point is nought from where the front bumper is to be, and grows with the distance to there."""
    length = town.road.perception().vehicle(0).length_m
    beyond = {"behind": -2.3 - 3.0, "beside": length / 2.0, "beyond": 2.3 + 3.0 + length}[call]
    speeds: list[float | None] = []
    for left in (0.2, 10.0, 25.0):
        town.street.where[17] = (left - beyond, -2.8, 0.0)
        speeds.append(ticked(executor, town, f"yield stop_{call}(who)").setpoints.target_speed_mps)
    assert speeds[0] == 0.0
    assert speeds[1] == pytest.approx((2.0 * 1.2 * 10.0) ** 0.5)
    assert speeds[2] is not None
    assert speeds[2] > speeds[1]


def test_what_one_follows_decides_lane_and_way(executor: ProgramExecutor, town: Town) -> None:
    assert ticked(executor, town, "yield follow_agent(who)").setpoints.turn is None
    town.street.lanes[17] = town.road.perception().adjacent_lane(town.road.perception().lane_of(0), 1) or "beside"
    assert ticked(executor, town, "yield follow_agent(who)").setpoints.target_lane == town.street.lanes[17]
    town.street.turned[17] = "left"
    assert ticked(executor, town, "yield follow_agent(who)").setpoints.turn == "left"


def test_who_crosses_is_waited_for_and_who_does_not_is_not(executor: ProgramExecutor, town: Town) -> None:
    limit = town.road.perception().speed_limit(town.road.perception().lane_of(0))
    assert ticked(executor, town, "yield give_way_to(who)").setpoints.target_speed_mps == limit
    town.street.users[17] = car(17, "pedestrian")
    town.street.crossing[17] = 3.6
    assert ticked(executor, town, "yield give_way_to(who)").setpoints.target_speed_mps == 0.0


@pytest.mark.parametrize(
    ("places", "gone"),
    [
        ([(20.0, -4.0, 0.0)], False),  # it stands beside the way
        ([(20.0, -4.0, 1.0), (20.0, 0.0, 1.0)], False),  # it is on the way
        ([(20.0, -4.0, 1.0), (20.0, 4.0, 0.0)], True),  # it has crossed, and stands
        ([(20.0, -4.0, -1.0)], True),  # it draws away
        ([(-12.0, -4.0, 0.0)], True),  # it is behind us
    ],
)
def test_when_a_road_user_has_gone(
    executor: ProgramExecutor, town: Town, places: list[tuple[float, float, float]], gone: bool
) -> None:
    town.street.users[17] = car(17, "pedestrian")
    source = "def go():\n    who = agent(17)\n    while True:\n        say(str(has_gone(who)))\n        yield stop()\n"
    assert executor.start(source, town) == "running"  # type: ignore[arg-type]
    said = ""
    for town.street.where[17] in places:
        said = executor.tick().said[0]
    assert said == str(gone)


def test_who_is_out_of_sight_has_gone_and_is_not_driven_to(executor: ProgramExecutor, town: Town) -> None:
    source = "def go():\n    who = agent(17)\n    yield stop()\n"
    source += "    say(str([in_sight(who), has_gone(who), has_passed(who)]))\n    yield stop_behind(who)\n"
    assert executor.start(source, town) == "running"  # type: ignore[arg-type]
    executor.tick()
    del town.street.users[17]
    tick = executor.tick()
    assert tick.said == ("[False, True, True]",)
    assert tick.state == "failed"
