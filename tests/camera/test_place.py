"""What stands along a road: never on a lane, and the same whoever looks."""

from __future__ import annotations

import numpy as np
from staged import agent, crossing, highway, observed

from chauffeur.camera import CameraLook, Conditions
from chauffeur.camera.ground import Marking, Paving
from chauffeur.camera.lane_field import LaneField
from chauffeur.camera.place import place_of
from chauffeur.camera.scene import SceneBuilder
from chauffeur.camera.solids import CLASS, SZ, SemanticClass, X, Y, Z
from chauffeur.geometry import RoadGraph


def test_nothing_that_reaches_the_ground_stands_on_a_lane():
    for road in (highway(), crossing()):
        for seed in range(4):
            place = place_of(road, seed)
            rows = place.solids.rows
            low = rows[:, Z] - rows[:, SZ] / 2.0 < 2.5
            built = np.isin(rows[:, CLASS], (SemanticClass.BUILDING, SemanticClass.VEGETATION, SemanticClass.POLE))
            middles = place.field.clearance(rows[:, [X, Y]].astype(float))
            assert (middles[low & built] > 0.3).all()
            houses = rows[:, CLASS] == SemanticClass.BUILDING
            assert (middles[houses] > 4.0).all()


def test_a_place_is_a_function_of_road_and_seed():
    one, same, other = place_of(crossing(), 3), place_of(crossing(), 3), place_of(crossing(), 4)
    assert (one.solids.rows == same.solids.rows).all() and (one.ground.triangles == same.ground.triangles).all()
    assert one.solids.rows.shape != other.solids.rows.shape or (one.solids.rows != other.solids.rows).any()
    assert one.surroundings == "town" and place_of(highway(), 0).surroundings == "country"


def test_driving_on_moves_nothing():
    road, builder = highway(), SceneBuilder()
    seen: list[set[tuple[float, ...]]] = []
    for x in (200.0, 205.0, 240.0):
        scene = builder.scene(observed(road, agent(0, x, -4.0)), Conditions(), CameraLook(), 1)
        rows = scene.view.solids.rows.astype(float)
        rows[:, X] += scene.view.origin_m[0]
        near = np.abs(rows[:, X] - 220.0) < 100.0
        seen.append({tuple(np.round(row, 2)) for row in rows[near][:, [X, Y, Z]]})
    assert seen[0] == seen[1] == seen[2] and len(seen[0]) > 20


def test_markings_say_what_lies_beside():
    def of(road: RoadGraph, y: float) -> tuple[set[int], set[int]]:
        rows = place_of(road, 0).ground.triangles
        lane = rows[(rows[:, 0, 7] == Paving.LANE) & (np.abs(rows[:, :, 1].mean(axis=1) - y) < 1.5)]
        return set(lane[:, 0, 5].astype(int).tolist()), set(lane[:, 0, 6].astype(int).tolist())

    assert of(highway(), 0.0) == ({Marking.YELLOW_EDGE}, {Marking.DASHED})
    assert of(highway(), -8.0) == ({Marking.DASHED}, {Marking.EDGE})
    west = RoadGraph(tuple(lane for lane in crossing().lanes if lane.id in ("in2", "out2")))
    assert of(west, -1.75) == ({Marking.DOUBLE_YELLOW}, {Marking.EDGE})  # oncoming traffic to the left


def test_clearance_and_covering_are_those_of_the_lanes():
    field = LaneField(highway(2))
    places = np.array([[100.0, 0.0], [100.0, -5.5], [100.0, 6.0], [100.0, 200.0], [-8.0, 0.0]])
    away = field.clearance(places)
    assert away[0] < 0.0 and away[1] < 0.0
    assert abs(away[2] - 4.0) < 0.3 and away[3] == 16.0 and abs(away[4] - 6.0) < 0.3
    on = field.covering(places)
    assert [int(field.lanes[i]) if i >= 0 else None for i in on] == [0, 1, None, None, None]
