"""Shapes of a road and of who is on it, as SVG and as pixels."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest
from sample_trips import highway_trip, intersection_trip

from chauffeur.concept import RoadGraph, Sign
from chauffeur.concept.paint import css_colour
from chauffeur.hmi.road import Bounds, draw_road
from chauffeur.hmi.stills import LOOKS, Canvas, DrawnShape, road_shapes, scene_shapes, svg_of
from chauffeur.hmi.view import facing_right, instants_of
from chauffeur.worlds.town.library import load
from roads import a_lane, a_road

EVERYWHERE = Bounds(-500.0, -500.0, 500.0, 500.0)


def elements(shapes: list[DrawnShape]) -> list[ET.Element]:
    return list(ET.fromstring(f"<svg>{svg_of(shapes)}</svg>"))


def colour_at(shapes: list[DrawnShape], x_m: float, y_m: float) -> str:
    """Of a picture of 40 by 40 m around a place, its middle pixel."""
    canvas = Canvas(400, 400, 10.0, (x_m, y_m))
    canvas.paint(shapes)
    return "#{:02x}{:02x}{:02x}".format(*canvas.image.getpixel((200, 200)))  # type: ignore[misc]


@pytest.mark.parametrize("trip", [highway_trip(seconds=2.0), intersection_trip()], ids=["highway", "crossing"])
def test_one_list_of_shapes_is_drawn_both_ways(trip: object) -> None:
    shots = facing_right(instants_of(trip))  # type: ignore[arg-type]
    road = list(road_shapes(draw_road(shots[0].road, shots[0].objects, EVERYWHERE, shots[0].signs)))
    moving = list(scene_shapes(shots, EVERYWHERE))
    assert len(elements(road + moving)) == len(road) + len(moving)
    classes = [element.get("class") for element in elements(moving)]
    assert classes.count("r-car r-ego") == 1
    assert {shape.look for shape in road + moving} <= set(LOOKS)
    ego = shots[-1].ego
    assert colour_at(road + moving, ego.x_m, ego.y_m) == LOOKS["ego"]
    assert colour_at(road, ego.x_m, ego.y_m) == LOOKS["asphalt"]


def test_a_road_user_has_its_own_colour_and_one_that_crashed_that_of_crashes() -> None:
    shot = facing_right(instants_of(highway_trip(seconds=1.0)))[-1]
    car = replace(shot.others[0], colour="blue")
    (blue,) = [
        s for s in scene_shapes([replace(shot, others=(car,))], EVERYWHERE) if s.kind == "car" and s.look == "other"
    ]
    assert blue.paint == css_colour("blue") and colour_at([blue], car.x_m, car.y_m) == css_colour("blue")
    (crashed,) = [
        s
        for s in scene_shapes([replace(shot, others=(replace(car, crashed=True),))], EVERYWHERE)
        if s.look == "crashed"
    ]
    assert colour_at([crashed], car.x_m, car.y_m) == LOOKS["crashed"]


def test_signs_are_told_apart_and_words_on_them_stay_words() -> None:
    road = a_road((a_lane("a-b:0", ((0.0, 0.0), (100.0, 0.0))),))
    signs = (
        Sign("1", "stop", ("a-b:0",), 50.0, 4.0, ((50.0, -2.0), (50.0, 2.0))),
        Sign("2", "yield", ("a-b:0",), 60.0, 4.0),
        Sign("3", "speed_limit", ("a-b:0",), 70.0, 4.0, value=30 / 3.6),
    )
    shapes = list(road_shapes(draw_road(road, (), EVERYWHERE, signs)))
    assert [element.text for element in elements(shapes) if element.tag == "text"] == ["STOP", "30"]
    assert colour_at([s for s in shapes if s.kind != "text"], 50.0, 4.0) == LOOKS["stop"]
    (bad,) = elements([DrawnShape("text", "word", ((0.0, 0.0),), text="</text><script>")])
    assert bad.text == "</text><script>"


def test_a_map_of_no_road_is_empty_ground() -> None:
    assert list(road_shapes(draw_road(RoadGraph(()), (), EVERYWHERE))) == []


def test_a_town_has_no_gaps_inside_its_junctions() -> None:
    town = load("Gridford")
    road = draw_road(town.road, (), EVERYWHERE.grown(1000.0))
    assert road.islands_m
    names = {lane.street for lane in town.road.lanes if lane.street}
    assert {name.text for name in road.names} == names
