"""Our own towns: they load without netconvert, are what their recipes say, and are roads that one can drive."""

from __future__ import annotations

import gzip
from dataclasses import replace
from xml.etree import ElementTree as ET

import pytest

from chauffeur.concept import DataError, Scenario
from chauffeur.geometry import LanePlace, Pose, named_ways, plan_route, turns_ahead
from chauffeur.geometry.opendrive import lane_name
from chauffeur.worlds.town.build import build_own
from chauffeur.worlds.town.library import load
from chauffeur.worlds.town.pack import MapPack
from chauffeur.worlds.town.recipes import TOWNS, plan_of


@pytest.fixture(params=sorted(TOWNS))
def town(request: pytest.FixtureRequest) -> MapPack:
    return load(str(request.param))


def test_a_town_has_what_a_town_has(town: MapPack) -> None:
    kinds = {lane.kind for lane in town.road.lanes}
    assert {"driving", "sidewalk"} <= kinds
    assert len(town.signals) >= 3
    assert town.crossings
    assert all(crossing.lanes for crossing in town.crossings)
    assert {"church", "station", "school", "bakery"} <= {place.kind for place in town.places}
    assert len({lane.street for lane in town.road.lanes if lane.street}) >= 5
    for group in town.signals:
        for phase in group.phases:
            assert len(phase.states) == len(group.heads)
        for head in group.heads:
            assert {one.junction for lane in head.lanes for one in town.road.successors(lane)} == {group.junction}
            assert town.sumo is not None
            assert head.id in town.sumo.links


def test_every_place_is_reached_from_every_other(town: MapPack) -> None:
    places = [LanePlace(one.lane, one.station_m, 0.0) for one in town.places]
    for start, goal in zip(places, [*places[1:], places[0]], strict=True):
        route = plan_route(town.road, start, goal)
        assert route is not None
        assert route.dense(town.road, 5.0)


def test_who_changes_lanes_does_not_leap(town: MapPack) -> None:
    """SUMO keeps the station on the lane: lanes of one edge have one length, also round a bend."""
    assert town.sumo is not None
    for edge in ET.fromstring(gzip.decompress(town.sumo.path.read_bytes())).iterfind("edge"):
        driven = [lane for lane in edge.iterfind("lane") if town.sumo.graph_lanes.get(lane.get("id", ""))]
        kinds = [town.road[town.sumo.graph_lanes[lane.get("id", "")][0]].kind for lane in driven]
        lengths = {lane.get("length") for lane, kind in zip(driven, kinds, strict=True) if kind == "driving"}
        assert len(lengths) <= 1, edge.get("id")


def test_what_is_shipped_is_what_the_recipe_draws(town: MapPack) -> None:
    pytest.importorskip("scenariogeneration")
    from chauffeur.worlds.town.opendrive_writer import draw

    drawn = draw(plan_of(town.name))
    assert gzip.decompress(town.xodr.read_bytes()) == drawn, "ship the towns again: chauffeur maps build NAME"


def test_carla_reads_our_towns_alike(town: MapPack) -> None:
    carla = pytest.importorskip("carla")
    theirs = {
        tuple(lane_name(str(one.road_id), one.section_id, one.lane_id) for one in pair)
        for pair in carla.Map(town.name, town.xodr_text()).get_topology()
    }
    assert theirs == {(lane.id, one) for lane in town.road.lanes if lane.kind == "driving" for one in lane.successors}


def test_sumo_shows_the_lights_of_the_pack() -> None:
    libsumo = pytest.importorskip("libsumo")
    pack = load("Ringstead")
    assert pack.sumo is not None
    libsumo.start(["sumo", "-n", str(pack.sumo.path), "--step-length", "0.5", "--no-step-log", "--no-warnings"])
    try:
        for step in range(120):
            libsumo.simulationStep()
            for signal in pack.signals_at(0.5 * step + 0.25):
                lights, links = pack.sumo.links[signal.id]
                state = libsumo.trafficlight.getRedYellowGreenState(lights)
                assert {state[link].lower() for link in links} == {signal.state[0]}
    finally:
        libsumo.close()


def test_another_seed_is_another_town() -> None:
    assert plan_of("Oldbridge", 1).crossroads != plan_of("Oldbridge").crossroads
    with pytest.raises(DataError, match="Gridford"):
        build_own("Atlantis")


def test_a_lane_wished_before_gives_way_to_the_one_that_a_turn_needs() -> None:
    """Else the shield would judge the car by the lane that it leaves."""
    pytest.importorskip("libsumo", reason="needs the extra `town`")
    from chauffeur.worlds.town import TownWorld

    pack = load("Northport")
    start = next(
        lane
        for lane in pack.road.lanes
        if lane.kind == "driving"
        and not lane.junction
        and lane.length_m > 90.0
        and any(way.lanes and way.entry != lane.id for way in named_ways(pack.road, lane.id).get("right", ()))
        and all(way.entry != lane.id for way in named_ways(pack.road, lane.id).get("right", ()))
    )
    beside = pack.road.neighbour(start.id, 1)
    world = TownWorld()
    config = {"town": "Northport", "start": (start.id, 10.0), "vehicles": 0, "people": 0}
    seen = world.reset(Scenario("over", "town", config, 1))
    try:
        driver = world.driver()
        wishes = replace(driver.initial_setpoints(), turn="right", target_lane=start.id)
        while seen.ego.lane == start.id and seen.time_s < 30.0:
            wishes = driver.settle(replace(wishes, target_speed_mps=None))
            world.step(driver.command(wishes))
            seen = world.observe()
        assert seen.ego.lane == beside
        assert wishes.target_lane == beside
    finally:
        world.close()


def test_a_turn_at_a_junction_behind_the_end_of_the_way_is_known_and_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("libsumo", reason="needs the extra `town`")
    from chauffeur.worlds.town import TownWorld, driver

    road, start = load("Gridford").road, "0:0:1"
    assert len(named_ways(road, start)) == 1, "the street leads round a corner before there is a choice"
    assert turns_ahead(road, start, [start]) == turns_ahead(road, start) == ("straight", "right")
    world = TownWorld()
    with monkeypatch.context() as short:
        short.setattr(driver, "_FREE_ROUTE_M", 10.0)
        config = {"town": "Gridford", "start": (start, 5.0), "vehicles": 0, "people": 0}
        seen = world.reset(Scenario("round", "town", config, 1))
        assert len(world.driver().route.lanes) < 4
    try:
        wishes = replace(world.driver().initial_setpoints(), turn="right")
        while wishes.turn is not None and seen.time_s < 90.0:
            wishes = world.driver().settle(replace(wishes, target_speed_mps=None))
            world.step(world.driver().command(wishes))
            seen = world.observe()
        assert wishes.turn is None
        here = seen.road.get(seen.ego.lane)
        assert here is not None
        assert here.turn == "right"
    finally:
        world.close()


def test_a_green_line_is_not_crossed_before_there_is_room_for_all_of_the_car_behind_it() -> None:
    """Who is ahead crawls, and may stop: a car that stands on the line when it turns red has run it."""
    pytest.importorskip("libsumo", reason="needs the extra `town`")
    from chauffeur.worlds.town import TownWorld

    pack = load("Gridford")
    head = next(one for group in pack.signals for one in group.heads if pack.road[one.lanes[0]].length_m > 60.0)
    lane = pack.road[head.lanes[0]]
    onward = min(pack.road.successors(lane.id), key=lambda one: abs(one.bend_rad))
    (ax, ay), (bx, by) = head.stop_line_m
    line = lane.centre.nearest((ax + bx) / 2.0, (ay + by) / 2.0) - lane.length_m
    world = TownWorld()
    at, crawls = line + 3.5, 1.6
    start = lane.id, lane.length_m + line - 6.0
    config = {"town": "Gridford", "start": start, "vehicles": 0, "people": 0, "ego_speed": crawls}
    seen = world.reset(Scenario("room", "town", config, 1))
    world.force_signal(head.id, "green")

    def place(at_m: float) -> Pose:
        return lane.centre.at(lane.length_m + at_m) if at_m < 0.0 else onward.centre.at(at_m)

    ahead = world.spawn("car", place(at), crawls)
    try:
        wishes = world.driver().initial_setpoints()
        crossed: list[float] = []
        while seen.time_s < 12.0 and not crossed:
            at += crawls * world.dt_s
            world.drive(ahead, place(at), crawls)
            world.step(world.driver().command(world.driver().settle(wishes)))
            seen = world.observe()
            nose = lane.centre.nearest(seen.ego.x_m, seen.ego.y_m) - lane.length_m + seen.ego.length_m / 2.0
            crossed = [at - line - 4.6 / 2.0] if nose > line else []
        assert crossed
        assert crossed[0] > seen.ego.length_m + 1.0
    finally:
        world.close()
