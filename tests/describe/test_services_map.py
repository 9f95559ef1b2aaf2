"""Which road a car is on: maps written as files, ways matched by place and heading."""

from __future__ import annotations

import gzip
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.concept import ConfigError, DataError, MissingExtraError
from chauffeur.describe.services import (
    Position,
    RoadMap,
    ServiceReading,
    Sources,
    SourceSettings,
    Unknown,
    load_road_map,
    load_rules,
    road_map,
)
from chauffeur.describe.services.osm_file import MAX_BYTES
from chauffeur.describe.services.readings import M_PER_DEG, distance_m
from chauffeur.describe.services.road_map import LOOK_AHEAD_M, REACH_M, RoadAhead
from chauffeur.describe.services.roads import Limit, RoadPlace, place_at
from chauffeur.describe.services.ways import ServiceWay, way_of

NOW = 1_700_000_000.0
LAT, LON = 48.0, 11.0
NORTH, EAST, SOUTH, WEST = 0.0, 90.0, 180.0, 270.0
GERMANY = load_rules("germany")


def at(east_m: float, north_m: float, heading_deg: float | None = None, **more: float) -> Position:
    """A position so many metres from the middle of the test's town."""
    return Position(*point(east_m, north_m), heading_deg, **more)


def point(east_m: float, north_m: float) -> tuple[float, float]:
    # Seven decimals, as OSM keeps them.
    latitude = LAT + north_m / M_PER_DEG
    return round(latitude, 7), round(LON + east_m / (M_PER_DEG * math.cos(math.radians(LAT))), 7)


def way(number: int, highway: str, *points: tuple[float, float], **tags: str) -> ServiceWay:
    made = way_of(
        number,
        {"highway": highway, **{key.replace("__", ":"): value for key, value in tags.items()}},
        [point(*one) for one in points],
    )
    assert made is not None
    return made


def kmh(place: RoadPlace) -> float | None:
    assert isinstance(place.limit, ServiceReading), place.limit
    speed_mps = place.limit.value.speed_mps
    return None if speed_mps is None else round(speed_mps * 3.6, 3)


# A motorway northwards, a service road 15 m beside it, a side street that crosses below a bridge, a town road.
MOTORWAY = way(1, "motorway", (0, -2000), (0, 0), (0, 2000), maxspeed="120", ref="A 9", lanes="3")
BESIDE = way(2, "service", (22, -2000), (22, 2000), maxspeed="20")
CROSSING = way(3, "residential", (-500, 50), (500, 50), maxspeed="30", name="Side Street")
TOWN = RoadMap([MOTORWAY, BESIDE, CROSSING], as_of_s=NOW - 86_400.0)


@pytest.mark.parametrize("north_m", [-300.0, 20.0, 50.0, 52.0, 80.0])
def test_a_motorways_limit_is_never_the_side_streets(north_m: float) -> None:
    place = place_at(TOWN, at(3.0, north_m, 2.0), GERMANY, NOW)
    assert kmh(place) == 120.0
    assert isinstance(place.road, ServiceReading)
    assert (place.road.value.road_class, place.road.value.name) == ("motorway", '"A 9"')
    assert (place.road.value.lanes, place.road.value.oneway) == (3, True)
    assert place.road.age_s == 86_400.0
    assert place.road.confidence > 0.8


@pytest.mark.parametrize(
    ("position", "expected"),
    [
        (at(1.0, 50.0, EAST + 4.0), 30.0),  # below the motorway
        (at(1.0, 50.0, WEST), 30.0),
        (at(9.0, -600.0, 0.0, accuracy_m=4.0), 120.0),  # its outer lane
        (at(22.0, -600.0, 0.0, accuracy_m=4.0), 20.0),
    ],
)
def test_place_and_heading_tell_the_road(position: Position, expected: float) -> None:
    assert kmh(place_at(TOWN, position, GERMANY, NOW)) == expected


def test_without_a_heading_a_crossing_is_unclear_and_so_said() -> None:
    place = place_at(TOWN, at(1.0, 50.0), GERMANY, NOW)
    assert place.limit == Unknown(
        "several roads with 30 km/h and 120 km/h are near, and it is not clear which one this is"
    )
    assert isinstance(place.road, Unknown)
    assert kmh(place_at(TOWN, at(0.0, -300.0), GERMANY, NOW)) == 120.0


def ahead_of(town: RoadMap, position: Position) -> RoadAhead:
    match = town.match(position)
    assert match is not None
    ahead = town.ahead(match.best)
    assert ahead is not None
    return ahead


def right_wrong_unknown(town: RoadMap, truth: list[tuple[float, Position]]) -> tuple[float, float, float]:
    """Parts of the positions whose limit is found rightly, wrongly, and not at all."""
    limits = [place_at(town, position, GERMANY, NOW).limit for _, position in truth]
    speeds = [round((one.value.speed_mps or 0.0) * 3.6) if isinstance(one, ServiceReading) else None for one in limits]
    right = sum(speed == kmh for speed, (kmh, _) in zip(speeds, truth, strict=True))
    unknown = speeds.count(None)
    return right / len(truth), (len(truth) - right - unknown) / len(truth), unknown / len(truth)


def test_limits_on_noisy_positions() -> None:
    """A motorway with two carriageways, a street beside it, streets across it; 5 m and 5 degrees of noise. Made up."""
    across = [200.0 * step + 37.0 for step in range(-14, 15)]
    town = RoadMap([
        way(1, "motorway", (0, -3000), (0, 3000), maxspeed="120", lanes="3"),
        way(2, "motorway", (-14, 3000), (-14, -3000), maxspeed="120", lanes="3"),
        way(3, "residential", (28, -3000), (28, 3000), maxspeed="30"),
        *(way(100 + number, "tertiary", (-800, y), (800, y), maxspeed="50") for number, y in enumerate(across)),
    ])  # fmt: skip
    rng = np.random.default_rng(3)

    def noisy(x: float, y: float, heading: float) -> Position:
        dx, dy, turn = (float(one) for one in rng.normal(0.0, 5.0, size=3))
        return at(x + dx, y + dy, heading + turn, accuracy_m=5.0)

    truth: list[tuple[float, Position]] = []
    for _ in range(200):
        truth.append((120.0, noisy(float(rng.choice([-3.5, 0.0, 3.5])), float(rng.uniform(-2800, 2800)), NORTH)))
        truth.append((30.0, noisy(29.7, float(rng.uniform(-2800, 2800)), NORTH)))
        truth.append((50.0, noisy(float(rng.uniform(-700, 700)), float(rng.choice(across)), EAST)))
    right, wrong, _ = right_wrong_unknown(town, truth)
    assert right > 0.97
    assert wrong < 0.02
    blind = [(kmh, Position(one.latitude_deg, one.longitude_deg, None, 5.0)) for kmh, one in truth]
    right_blind, _, unknown_blind = right_wrong_unknown(town, blind)
    assert right_blind < right  # the heading is worth something
    assert unknown_blind > 0.03


def test_against_a_one_way_road_there_is_no_road() -> None:
    place = place_at(TOWN, at(0.0, -300.0, SOUTH), None, NOW)
    assert place.road == Unknown("the map has no road here that points the same way") or (
        isinstance(place.road, ServiceReading) and place.road.value.road_class == "service"
    )
    alone = RoadMap([MOTORWAY])
    assert isinstance(place_at(alone, at(0.0, -300.0, SOUTH), None, NOW).limit, Unknown)


def test_far_from_every_road() -> None:
    assert TOWN.match(at(300.0, 300.0)) is None
    assert TOWN.match(Position(-33.0, 151.0)) is None
    assert TOWN.match(Position(89.9, 0.0)) is None
    nearby = at(-30.0, -600.0, NORTH, accuracy_m=4.0)  # 30 m beside the motorway, whose half is 5 m wide
    assert TOWN.match(nearby) is not None
    assert place_at(TOWN, nearby, None, NOW).limit == Unknown("the map has no road here that points the same way")
    assert place_at(TOWN, at(300.0, 300.0), None, NOW).road == Unknown("the map has no road here")


def test_forward_and_backward() -> None:
    road = way(1, "primary", (0, 0), (0, 500), maxspeed__forward="70", maxspeed__backward="50")
    for reversed_too in (False, True):
        drawn = (
            road
            if not reversed_too
            else way(1, "primary", (0, 500), (0, 0), maxspeed__forward="50", maxspeed__backward="70")
        )
        town = RoadMap([drawn])
        assert kmh(place_at(town, at(0.0, 200.0, NORTH), None, NOW)) == 70.0
        assert kmh(place_at(town, at(0.0, 200.0, SOUTH), None, NOW)) == 50.0
        assert kmh(place_at(town, at(0.0, 200.0), None, NOW)) == 50.0


def test_one_way_against_the_points() -> None:
    town = RoadMap([way(1, "primary", (0, 0), (0, 500), oneway="-1", maxspeed="60")])
    assert kmh(place_at(town, at(0.0, 200.0, SOUTH), None, NOW)) == 60.0
    assert town.match(at(0.0, 200.0, NORTH)) is None
    match = town.match(at(0.0, 200.0))
    assert match is not None
    assert match.best.forward is False


def test_where_a_limit_changes_the_lower_one_counts_for_some_metres() -> None:
    town = RoadMap([
        way(1, "primary", (0, -500), (0, 0), maxspeed="100"), way(2, "primary", (0, 0), (0, 500), maxspeed="70"),
    ])  # fmt: skip
    near = place_at(town, at(0.0, 0.0, NORTH), GERMANY, NOW)
    assert kmh(near) == 70.0
    assert isinstance(near.limit, ServiceReading)
    assert near.limit.value.detail == "it changes here between 70 km/h and 100 km/h; the lower one is given"
    assert kmh(place_at(town, at(0.0, -40.0, NORTH), GERMANY, NOW)) == 100.0
    assert kmh(place_at(town, at(0.0, 40.0, NORTH), GERMANY, NOW)) == 70.0


@pytest.mark.parametrize(
    ("highway", "tags", "kmh_given", "origin", "said"),
    [
        ("residential", {}, 50.0, "default", "the map gives none"),
        ("motorway", {}, None, "default", "the map gives none"),
        ("motorway", {"maxspeed": "none"}, None, "map", ""),
        ("primary", {}, 50.0, "default",
         "the map gives none; by law 50 km/h in built-up areas and 100 km/h elsewhere, the lower one is given"),
        ("primary", {"maxspeed": "DE:rural"}, 100.0, "zone", ""),
        ("primary", {"zone:traffic": "DE:urban"}, 50.0, "zone", ""),
        ("motorway", {"maxspeed": "DE:motorway"}, None, "zone", ""),
        ("living_street", {"maxspeed": "walk"}, 7.0, "map", "walking pace"),
        ("primary", {"maxspeed": "fast"}, 50.0, "default", "what the map says of it cannot be read; by law 50 km/h in "
         "built-up areas and 100 km/h elsewhere, the lower one is given"),
        ("residential", {"maxspeed": "FR:urban"}, 50.0, "default",
         "the map names a kind of place that no loaded rules know"),
        ("primary", {"maxspeed": "30;50"}, 30.0, "map", "the map gives several; this is the lowest"),
        ("motorway", {"maxspeed": "120", "maxspeed:variable": "yes"}, 120.0, "map",
         "signs over the road may show another one"),
    ],
)  # fmt: skip
def test_where_a_limit_comes_from_is_told(
    highway: str, tags: dict[str, str], kmh_given: float | None, origin: str, said: str
) -> None:
    town = RoadMap([way(1, highway, (0, 0), (0, 500), **{key.replace(":", "__"): one for key, one in tags.items()})])
    place = place_at(town, at(0.0, 200.0, NORTH), GERMANY, NOW)
    assert kmh(place) == kmh_given
    assert isinstance(place.limit, ServiceReading)
    limit: Limit = place.limit.value
    assert (limit.origin, limit.detail) == (origin, said)
    assert limit.advisory_mps == (pytest.approx(130 / 3.6) if kmh_given is None else None)


@pytest.mark.parametrize(
    ("highway", "tags", "said"),
    [
        ("primary", {}, "the map gives none, and no region's rules are loaded"),
        ("track", {}, "the map gives none, and the rules of Germany have none for this class of road"),
        ("motorway_link", {}, "the map gives none, and the rules of Germany have none for this class of road"),
        ("motorway", {"maxspeed": "signals"}, "signs over the road show it, and the map cannot"),
    ],
)
def test_a_limit_that_nobody_gives_is_not_known(highway: str, tags: dict[str, str], said: str) -> None:
    town = RoadMap([way(1, highway, (0, 0), (0, 500), **tags)])
    rules = None if "no region" in said else GERMANY
    assert place_at(town, at(0.0, 200.0, NORTH), rules, NOW).limit == Unknown(said)


# A road of two ways, a bend at (0, 300), a driveway at (0, 100), a side road at (200, 300).
STREET = RoadMap([
    way(1, "tertiary", (0, 0), (0, 100), (0, 300)),
    way(2, "tertiary", (0, 300), (200, 300), (900, 300)),
    way(3, "service", (0, 100), (-50, 100)),
    way(4, "residential", (200, 300), (200, 700)),
])  # fmt: skip


@pytest.mark.parametrize(
    ("position", "junction_m", "seen_m"),
    [
        (at(0, 50, NORTH), 450.0, 450.0),
        (at(0, 150, NORTH), 350.0, 350.0),
        (at(100, 300, EAST), 100.0, 100.0),
        (at(100, 300, WEST), None, 400.0),
        (at(300, 300, WEST), 100.0, 100.0),
        (at(300, 300, EAST), None, 600.0),
        (at(200, 500, SOUTH), 200.0, 200.0),
        (at(-30, 100, EAST), 30.0, 30.0),
    ],
)
def test_the_next_junction_is_measured_along_the_road(
    position: Position, junction_m: float | None, seen_m: float
) -> None:
    ahead = ahead_of(STREET, position)
    assert ahead.junction_m == (None if junction_m is None else pytest.approx(junction_m, abs=0.5))
    assert ahead.seen_m == pytest.approx(seen_m, abs=0.5)
    blind = Position(position.latitude_deg, position.longitude_deg)
    assert place_at(STREET, blind, None, NOW).ahead == Unknown("the heading is not known")


def test_a_road_without_junctions_is_followed_so_far_and_no_farther() -> None:
    town = RoadMap([way(1, "trunk", *((0, 100 * step) for step in range(60)))])
    ahead = ahead_of(town, at(0, 50, NORTH))
    assert (ahead.junction_m, ahead.seen_m) == (None, LOOK_AHEAD_M)
    ring = RoadMap([way(1, "primary", (0, 0), (0, 30), (30, 30), (30, 0), (0, 0))])
    ahead_of(ring, at(0, 15, NORTH))  # comes to an end


def test_a_road_does_not_go_on_against_a_one_way_street() -> None:
    town = RoadMap([way(1, "primary", (0, 0), (0, 100)), way(2, "primary", (0, 300), (0, 100), oneway="yes")])
    ahead = ahead_of(town, at(0, 50, NORTH))
    assert ahead.seen_m == pytest.approx(50.0, abs=0.5)


def test_a_map_of_a_circle_does_not_speak_of_what_is_beyond_it() -> None:
    centre = Position(*point(0, 0))
    street = [way(1, "tertiary", *((0, 50 * step) for step in range(40))), way(2, "primary", (-9, 1500), (9, 1500))]
    town = RoadMap(street, extent=(centre, 500.0))
    ahead = ahead_of(town, at(0, 10, NORTH))
    assert ahead.junction_m is None
    assert 350.0 < ahead.seen_m < 500.0
    assert town.covers(centre)
    assert not town.covers(at(0, 480))


def test_the_180th_meridian_is_an_ordinary_place() -> None:
    made = way_of(1, {"highway": "primary", "maxspeed": "80"}, [(-16.8, 179.999), (-16.8, -179.999)])
    assert made is not None
    town = RoadMap([made])
    for longitude in (179.9995, -179.9995, 180.0, -180.0):
        match = town.match(Position(-16.8, longitude, EAST))
        assert match is not None, longitude
        assert match.best.distance_m < 1.0
    assert town.match(Position(-16.8, 0.0)) is None


def test_lines_that_cannot_be_roads_are_left_out() -> None:
    across_the_world = way_of(1, {"highway": "primary"}, [(48.0, 11.0), (-33.0, 151.0)])
    at_the_pole = way_of(2, {"highway": "primary"}, [(89.0, 0.0), (89.0, 90.0)])
    assert across_the_world is not None
    assert at_the_pole is not None
    town = RoadMap([across_the_world, at_the_pole, MOTORWAY])
    assert len(town._bearing) == 2  # those of MOTORWAY
    assert town.match(at(0, 0, NORTH)) is not None
    assert RoadMap([]).match(at(0, 0)) is None
    assert way_of(3, {"highway": "primary"}, [(48.0, 11.0)]) is None
    assert way_of(3, {"highway": "primary"}, [(48.0, 11.0), (math.nan, 11.0)]) is None
    assert way_of(3, {"highway": "cycleway"}, [(48.0, 11.0), (48.1, 11.0)]) is None
    assert way_of(4, {"highway": "primary"}, [(48.0, 11.0), (48.0, 11.0)]) is None
    twice = way_of(4, {"highway": "primary"}, [(48.0, 11.0), (48.001, 11.0), (48.001, 11.0), (48.002, 11.0)])
    assert twice is not None
    assert len(twice.points) == 3


@pytest.mark.parametrize(
    ("tags", "lanes", "oneway"),
    [
        ({}, None, 0),
        ({"lanes": "2"}, 2, 0),
        ({"lanes": "2;3"}, 2, 0),
        ({"lanes": "many"}, None, 0),
        ({"lanes": "99"}, None, 0),
        ({"lanes": "²"}, None, 0),
        ({"oneway": "yes"}, None, 1),
        ({"oneway": "reverse"}, None, -1),
        ({"junction": "roundabout"}, None, 1),
        ({"highway": "motorway"}, None, 1),
        ({"highway": "motorway", "oneway": "no"}, None, 0),
    ],
)
def test_lanes_and_direction(tags: dict[str, str], lanes: int | None, oneway: int) -> None:
    made = way_of(1, {"highway": "primary", **tags}, [(0.0, 0.0), (0.0, 1.0)])
    assert made is not None
    assert (made.lanes, made.oneway) == (lanes, oneway)


def away_m(position: Position, road: ServiceWay) -> float:
    """Distance to a way's line by walking along it in steps of half a metre: slow, and not the map's own arithmetic."""
    best = math.inf
    for (lat0, lon0), (lat1, lon1) in zip(road.points, road.points[1:], strict=False):
        steps = max(2, int(distance_m(Position(lat0, lon0), Position(lat1, lon1)) / 0.5))
        for share in np.linspace(0.0, 1.0, steps):
            step = Position(lat0 + float(share) * (lat1 - lat0), lon0 + float(share) * (lon1 - lon0))
            best = min(best, distance_m(position, step))
    return best


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_the_tree_finds_every_road_in_reach(seed: int) -> None:
    rng = np.random.default_rng(seed)
    roads = [
        way(number, "residential", *((float(x), float(y)) for x, y in rng.uniform(-400, 400, size=(3, 2))))
        for number in range(6)
    ]
    town = RoadMap(roads)
    position = at(*(float(one) for one in rng.uniform(-300, 300, size=2)), accuracy_m=900.0)
    near = {one.id: away_m(position, one) for one in roads}
    found = {one.way.id: one.distance_m for one in town._near(position)}
    assert {number for number, away in near.items() if away < REACH_M - 0.5} <= set(found)
    assert set(found) <= {number for number, away in near.items() if away < REACH_M + 0.5}
    for number, away in found.items():
        assert away == pytest.approx(near[number], abs=0.3)


def grid_town(blocks: int) -> RoadMap:
    lines = [100.0 * step for step in range(blocks)]
    roads = [way(number, "residential", *((x, y) for x in lines), maxspeed="50") for number, y in enumerate(lines)]
    roads += [way(900 + number, "primary", *((x, y) for y in lines)) for number, x in enumerate(lines)]
    return RoadMap(roads)


def test_a_lookup_takes_far_less_than_a_millisecond() -> None:
    town = grid_town(60)
    rng = np.random.default_rng(7)
    positions = [at(*rng.uniform(0, 5900, size=2), float(rng.uniform(0, 360))) for _ in range(400)]
    best_s = math.inf
    for _ in range(3):
        began = time.process_time()
        found = sum(place_at(town, one, GERMANY, NOW).road.__class__ is ServiceReading for one in positions)
        best_s = min(best_s, (time.process_time() - began) / len(positions))
    assert found > 200
    assert best_s < 1e-3


def test_a_map_cannot_be_made_to_take_all_memory_or_time(monkeypatch: pytest.MonkeyPatch) -> None:
    to_and_fro = tuple((48.0, 11.0 + 0.3 * (number % 2)) for number in range(2_000))
    crowd = tuple(point(0.01 * (number % 7), number * 0.01) for number in range(2_000))
    for points in (to_and_fro, crowd):
        heap = [way_of(number, {"highway": "primary"}, points) for number in range(40)]
        town = RoadMap([one for one in heap if one is not None], extent=(Position(48.0, 11.0), 500.0))
        began = time.process_time()
        assert town.match(at(1.0, 5.0)) is not None
        assert time.process_time() - began < 0.5
    monkeypatch.setattr(road_map, "_MOST", 1)
    with pytest.raises(DataError, match="too many roads"):
        RoadMap([MOTORWAY])


# Files.


def write_file(path: Path, header: dict[str, str] | None = None) -> Path:
    """A real file by osmium's own writer: MOTORWAY, CROSSING, and things that are no roads."""
    pytest.importorskip("osmium", reason="maps need pyosmium: pip install 'chauffeur[map]'")
    import osmium
    import osmium.io
    import osmium.osm.mutable as mutable

    made = osmium.io.Header()
    for key, value in (header or {}).items():
        made.set(key, value)
    with osmium.SimpleWriter(str(path), header=made) as writer:
        number = 0
        ways: list[Any] = []
        for road in (MOTORWAY, CROSSING):
            nodes: list[int] = []
            for latitude, longitude in road.points:
                number += 1
                writer.add_node(mutable.Node(id=number, location=(longitude, latitude)))
                nodes.append(number)
            tags = {"highway": road.road_class, "name": road.name, **road.limits}
            ways.append(mutable.Way(id=road.id, nodes=nodes, tags=tags))
        ways.append(mutable.Way(id=50, nodes=[1, 2], tags={"highway": "footway"}))
        ways.append(mutable.Way(id=51, nodes=[1, 2], tags={"building": "yes"}))
        ways.append(mutable.Way(id=52, nodes=[1, 999, 2], tags={"highway": "service"}))
        ways.append(mutable.Way(id=53, nodes=[998, 999], tags={"highway": "service"}))
        for one in ways:
            writer.add_way(one)
    return path


@pytest.mark.parametrize("ending", ["osm.pbf", "osm", "osm.bz2"])
def test_a_file_is_read(tmp_path: Path, ending: str) -> None:
    town = load_road_map(write_file(tmp_path / f"town.{ending}"))
    assert [one.id for one in town.ways] == [1, 3, 52]
    assert len(town.ways[2].points) == 2
    assert town.source == f"OpenStreetMap file town.{ending}"
    assert town.as_of_s == (tmp_path / f"town.{ending}").stat().st_mtime
    place = place_at(town, at(3.0, 50.0, 2.0), GERMANY, NOW)
    assert kmh(place) == 120.0


def test_the_time_of_the_data_is_the_files_own(tmp_path: Path) -> None:
    path = write_file(tmp_path / "town.osm.pbf", {"osmosis_replication_timestamp": "2023-11-14T22:00:00Z"})
    assert load_road_map(path).as_of_s == 1_699_999_200.0


def test_files_that_are_no_maps(tmp_path: Path) -> None:
    whole = write_file(tmp_path / "town.osm.pbf").read_bytes()
    half = tmp_path / "half.osm.pbf"
    half.write_bytes(whole[: len(whole) // 2])
    noise = tmp_path / "noise.osm.pbf"
    noise.write_bytes(bytes(range(256)) * 20)
    packed = tmp_path / "packed.osm.gz"
    packed.write_bytes(gzip.compress(b"<osm>")[:-4])
    for path in (half, noise, packed):
        with pytest.raises(DataError, match="not whole, or not what its name says"):
            load_road_map(path)
    empty = tmp_path / "empty.osm"
    empty.write_text("<?xml version='1.0'?><osm version='0.6'></osm>")
    with pytest.raises(DataError, match="has no roads"):
        load_road_map(empty)
    with pytest.raises(DataError, match="cannot be read"):
        load_road_map(tmp_path / "absent.osm.pbf")
    with pytest.raises(DataError, match="is not a map"):
        load_road_map(tmp_path / "town.txt")
    with (tmp_path / "planet.osm.pbf").open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    with pytest.raises(DataError, match="MB") as caught:
        load_road_map(tmp_path / "planet.osm.pbf")
    assert "osmium extract" in caught.value.hint


@pytest.mark.parametrize("library", ["osmium", "shapely"])
def test_without_its_libraries_it_is_said_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: str
) -> None:
    path = tmp_path / "town.osm.pbf"
    path.write_bytes(b"")
    monkeypatch.setitem(sys.modules, library, None)
    asking: list[Callable[[], object]] = [lambda: load_road_map(path)]
    if library == "shapely":
        asking += [lambda: RoadMap([]), lambda: Sources(SourceSettings(at(0, 0), ["map"]))]
    for ask in asking:
        with pytest.raises(MissingExtraError) as caught:
            ask()
        assert "[map]" in caught.value.hint


@pytest.mark.parametrize(
    ("numbers", "said"),
    [
        *((one, "is not a position") for one in ((91.0, 0.0), (0.0, 181.0), (math.nan, 0.0), (0.0, math.inf))),
        ((0.0, 0.0, math.nan), "heading"),
        ((0.0, 0.0, None, 0.0), "accuracy"),
    ],
)
def test_what_is_no_position_is_refused(numbers: tuple[Any, ...], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        Position(*numbers)
