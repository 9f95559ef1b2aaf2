"""Where a body may be: kind of lane, direction, the whole outline, on its way. The street is drawn by hand."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from chauffeur.geometry import Box, Lane, LaneKind, Polyline, RoadGraph
from chauffeur.geometry.ground import EDGE_M, FAR_M, OFF_ROAD_M, swept

LENGTH, WIDTH = 4.6, 1.8


def _lane(name: str, y: float, kind: LaneKind = "driving", *, back: bool = False, **more: object) -> Lane:
    ends = [(0.0, y), (200.0, y)]
    width = {"sidewalk": 2.0, "bicycle": 1.5, "emergency": 2.5, "parking": 2.5}.get(kind, 3.5)
    return Lane(name, Polyline.of(ends[::-1] if back else ends), width, 13.9, kind, **more)  # type: ignore[arg-type]


STREET = RoadGraph(
    (
        _lane("oncoming", 3.5, back=True, road="back"),
        _lane("own", 0.0, road="own"),
        _lane("shoulder", -3.0, "emergency", road="own", index=1),
        _lane("pavement", -5.25, "sidewalk", road="own", index=2),
        Lane("crosswalk", Polyline.of(((100.0, -6.0), (100.0, 6.0))), 4.0, 13.9, "crossing"),
    )
)


def beyond(x: float, y: float, degrees: float = 0.0, *, road: RoadGraph = STREET, **how: bool) -> float:
    return float(road.ground.beyond_m(np.array([[x, y, math.radians(degrees)]]), LENGTH, WIDTH, **how)[0])


@pytest.mark.parametrize(
    ("y", "degrees", "stops", "expected"),
    [
        (0.0, 0.0, False, 0.0),
        (0.8, 0.0, False, 0.0),  # 1.7 m to the left of a middle that is 1.75 m from the line
        (1.35, 0.0, False, 0.5),  # half a metre over the line, though the oncoming lane is paved
        (0.0, 20.0, False, 0.0),
        (3.5, 0.0, False, 2.65),  # all of it in the oncoming lane
        (3.5, 180.0, False, 0.0),  # which is another's own
        (0.0, 180.0, False, 2.65),  # against the lane
        (-1.0, 0.0, False, 0.15),  # over the edge of the lane, onto the shoulder
        (-1.0, 0.0, True, 0.0),  # where who stops may be
        (-3.3, 0.0, True, 0.0),
        (-3.6, 0.0, True, 0.25),  # on the pavement
    ],
)
def test_lanes_are_for_their_kind_and_direction(y: float, degrees: float, stops: bool, expected: float) -> None:
    assert beyond(50.0, y, degrees, stops=stops) == pytest.approx(expected, abs=1e-6)


def test_a_crossing_is_passed_on_its_lane_and_not_driven_along() -> None:
    assert beyond(100.0, 0.0) == 0.0
    assert beyond(100.0, -5.0, 90.0, stops=True) > 1.0


@pytest.mark.parametrize(
    ("y", "stops", "kind"),
    [(2.0, True, "oncoming"), (-2.0, False, "emergency"), (-4.2, True, "sidewalk"), (9.0, True, "off_road")],
)
def test_what_is_wrong_is_said(y: float, stops: bool, kind: str) -> None:
    poses = np.array([[40.0, 0.0, 0.0], [45.0, y, 0.0]])
    fault = STREET.ground.fault(poses, LENGTH, WIDTH, stops=stops)
    assert fault is not None
    assert (fault.index, fault.kind) == (1, kind)
    assert EDGE_M < fault.beyond_m <= FAR_M
    assert STREET.ground.fault(poses[:1], LENGTH, WIDTH) is None


def test_the_whole_outline_counts_and_not_its_corners_alone() -> None:
    # A kerb's corner between the axles: two lanes that meet at a right angle, and a body over the inner corner.
    corner = RoadGraph(
        (
            Lane("in", Polyline.of(((-50.0, 0.0), (0.0, 0.0))), 3.0, 9.0, road="in", successors=("out",), junction="j"),
            Lane("out", Polyline.of(((0.0, 0.0), (0.0, -50.0))), 3.0, 9.0, road="out", junction="j"),
        )
    )
    body = Box(-1.35, -1.35, math.radians(-45.0), 5.0, 1.0)
    poses = np.array([[body.x_m, body.y_m, body.heading_rad]])
    assert corner.ground.beyond_m(poses, body.length_m, body.width_m)[0] > 0.15
    assert all(corner.ground.off_m(x, y) == 0.0 for x, y in body.corners())


def test_on_its_way_nothing_is_leapt_over() -> None:
    poses = np.array([[40.0, 0.0, 0.0], [60.0, 5.0, 0.4], [80.0, 0.0, 0.0]])
    between, share = swept(poses)
    assert (np.hypot(*np.diff(between[:, :2], axis=0).T) <= 0.51).all()
    assert share[0] == 0.0
    assert share[-1] == 2.0
    at = STREET.ground.fault(between, LENGTH, WIDTH)
    assert at is not None
    assert share[at.index] < 1.0, "out before the waypoint that is out"


def test_where_a_map_ends_its_lanes_go_on_and_a_lot_is_what_is_paved() -> None:
    assert beyond(250.0, 0.0) == 0.0
    lot = RoadGraph((_lane("aisle", 0.0, "aisle"),), paved=(Box(100.0, 0.0, 0.0, 200.0, 20.0),))
    assert beyond(50.0, 7.0, 77.0, road=lot) == 0.0
    assert beyond(50.0, 9.5, road=lot) == pytest.approx(0.4)
    assert beyond(250.0, 0.0, road=lot) > 1.0


def test_slits_between_lanes_abreast_are_road() -> None:
    # A lane that widens is known by its mean width: between it and the next there seems to be a slit of 0.8 m.
    lanes = (_lane("a", 4.3, road="r", index=0), _lane("b", 0.0, road="r", index=1))
    assert beyond(50.0, 2.1, road=RoadGraph(lanes)) == 0.0


def test_a_car_is_off_the_road_when_its_middle_is_well_beyond_every_lane() -> None:
    ground = STREET.ground
    assert not ground.off_road(50.0, 3.5)  # on the wrong side is on the road
    assert not ground.off_road(50.0, -4.25 - OFF_ROAD_M + 0.01)
    assert ground.off_road(50.0, -4.25 - OFF_ROAD_M - 0.01)
    assert ground.off_road(50.0, 400.0)


def test_a_road_of_no_lanes_has_no_ground() -> None:
    assert beyond(0.0, 0.0, road=RoadGraph(())) == FAR_M


def test_it_is_asked_every_period() -> None:
    poses = np.stack([np.linspace(20.0, 60.0, 40), np.full(40, 0.3), np.zeros(40)], axis=1)
    STREET.ground.beyond_m(poses, LENGTH, WIDTH)
    taken = []
    for _ in range(20):
        begun = time.process_time()
        STREET.ground.beyond_m(poses, LENGTH, WIDTH)
        taken.append(time.process_time() - begun)
    assert min(taken) < 0.002
