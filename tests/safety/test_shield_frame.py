"""The frame the shield looks in, and what a car sweeps in it: against turned roads, circles and plain formulas."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept import Lane, LaneId, Observation, VehicleState
from chauffeur.control import LAMPILOT_STEERING, lane_keeping_steering
from chauffeur.geometry import Polyline
from chauffeur.safety.shield.frame import ShieldBody, ShieldLens, ShieldScene, Strip
from chauffeur.safety.shield.sweep import recovery_steering, swept, yaw_rate
from roads import a_lane, a_road

OWN: LaneId = "a-b:1"
Points = tuple[tuple[float, float], ...]


def lane(index: int, *points: tuple[float, float], width: float = 4.0, limit: float = 30.0) -> Lane:
    return a_lane(f"a-b:{index}", points, width=width, limit=limit)


STRAIGHT = tuple(lane(i, (0.0, 4.0 * (1 - i)), (1000.0, 4.0 * (1 - i))) for i in range(3))
"""Three lanes along x; the middle one's centre is y = 0."""


def car(number: int, x: float, y: float, heading: float = 0.0, speed: float = 10.0) -> VehicleState:
    return VehicleState(number, "car", x, y, heading, speed, 5.0, 2.0, OWN)


def observation(ego: VehicleState, *others: VehicleState, lanes: tuple[Lane, ...] = STRAIGHT) -> Observation:
    return Observation(0.0, 0, "highway", ego, others, (), a_road(lanes), None, None, False, False)


def looked(ego: VehicleState, *others: VehicleState, lanes: tuple[Lane, ...] = STRAIGHT) -> ShieldScene:
    scene = ShieldLens().look(observation(ego, *others, lanes=lanes), OWN)
    assert scene is not None
    return scene


def numbers(body: ShieldBody) -> tuple[float, ...]:
    return (
        body.s_m, body.d_m, body.heading_rad, body.along_mps, body.across_mps, body.half_length_m, body.half_width_m,
    )  # fmt: skip


places = st.floats(-30.0, 30.0)
headings = st.floats(-3.0, 3.0)


# The frame ------------------------------------------------------------------------------------------------------------


def test_along_a_straight_lane_the_frame_is_plain() -> None:
    scene = looked(car(0, 500.7, 0.5, 0.1, 20.0), car(7, 530.0, 4.5, -0.2, 8.0))
    c, s = math.cos(0.1), math.sin(0.1)
    assert numbers(scene.ego) == pytest.approx((0.0, 0.5, 0.1, 20.0 * c, 20.0 * s, 2.5 * c + s, 2.5 * s + c))
    (other,) = scene.others
    c, s = math.cos(0.2), math.sin(0.2)
    assert other.id == 7
    assert numbers(other) == pytest.approx((29.3, 4.5, -0.2, 8.0 * c, -8.0 * s, 2.5 * c + s, 2.5 * s + c))
    assert (scene.speed_limit_mps, scene.curvature) == (30.0, 0.0)
    assert [(int(strip.lane[-1]), strip.centre_m, strip.low_m, strip.high_m) for strip in scene.strips] == [
        (0, 4.0, 2.0, 6.0), (1, 0.0, -2.0, 2.0), (2, -4.0, -6.0, -2.0),
    ]  # fmt: skip


@given(
    turned=headings, x0=st.floats(-500.0, 500.0), y0=st.floats(-500.0, 500.0), x=places, y=st.floats(-5.0, 5.0),
    heading=headings, other_x=places, other_y=places, other_heading=headings,
)  # fmt: skip
def test_where_a_road_lies_in_the_world_does_not_matter(
    turned: float, x0: float, y0: float, x: float, y: float, heading: float,
    other_x: float, other_y: float, other_heading: float,
) -> None:  # fmt: skip
    c, s = math.cos(turned), math.sin(turned)

    def moved(point: tuple[float, float]) -> tuple[float, float]:
        return x0 + c * point[0] - s * point[1], y0 + s * point[0] + c * point[1]

    def there(vehicle: VehicleState) -> VehicleState:
        x_m, y_m = moved((vehicle.x_m, vehicle.y_m))
        return replace(vehicle, x_m=x_m, y_m=y_m, heading_rad=vehicle.heading_rad + turned)

    ego, other = car(0, 500.0 + x, y, heading), car(1, 500.0 + other_x, other_y, other_heading)
    lanes = tuple(replace(one, centre=Polyline.of(moved(point) for point in one.centre.points_m)) for one in STRAIGHT)
    here, elsewhere = looked(ego, other), looked(there(ego), there(other), lanes=lanes)
    for one, same in ((here.ego, elsewhere.ego), (here.others[0], elsewhere.others[0])):
        assert numbers(one) == pytest.approx(numbers(same), abs=1e-6)
    for strip, same in zip(here.strips, elsewhere.strips, strict=True):
        assert (strip.lane, strip.centre_m) == (same.lane, pytest.approx(same.centre_m, abs=1e-6))
    assert elsewhere.curvature == 0.0


def circle(radius: float, side: float) -> tuple[Lane, ...]:
    """Three lanes on circles about (0, side * radius), each a point every half degree from heading 0."""

    def points(off: float) -> Points:
        return tuple(
            (
                (radius - off) * math.sin(angle),
                side * (radius - (radius - off) * math.cos(angle)),
            )
            for angle in (math.radians(n / 2.0) for n in range(181))
        )

    return tuple(lane(i, *points(side * 4.0 * (1 - i))) for i in range(3))


@given(radius=st.floats(20.0, 200.0), side=st.sampled_from([-1.0, 1.0]), at=st.floats(0.4, 0.8))
def test_a_lane_that_bends_is_followed_as_the_circle_it_is(radius: float, side: float, at: float) -> None:
    """`side` 1: to the left; the place across is counted that way too."""
    reach = radius - side * 0.3
    ego = car(0, reach * math.sin(at), side * (radius - reach * math.cos(at)), side * at + 0.05)
    scene = looked(ego, lanes=circle(radius, side))
    # The lane is a chain of chords, half a degree each: its curvature is measured over 3 m of them.
    off_rad = math.radians(0.5)
    assert scene.curvature == pytest.approx(side / radius, abs=off_rad / 3.0 + 1e-3)
    assert scene.ego.s_m == 0.0
    assert scene.ego.d_m == pytest.approx(0.3, abs=0.02 + 0.02 * off_rad * radius)
    assert scene.ego.heading_rad == pytest.approx(0.05, abs=2.0 * off_rad)
    assert [strip.centre_m for strip in scene.strips] == pytest.approx([4.0, 0.0, -4.0], abs=0.1)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_on_a_fine_circle_way_offset_and_heading_are_those_along_it(side: float) -> None:
    radius = 60.0
    scene = looked(
        car(0, 0.0, 0.0, 0.0),
        car(1, (radius - 2.0) * math.sin(0.5), side * (radius - (radius - 2.0) * math.cos(0.5)), side * 0.5 + 0.1),
        car(2, (radius + 3.0) * math.sin(-0.3), side * (radius - (radius + 3.0) * math.cos(-0.3)), side * -0.3),
        lanes=(lane(1, (-100.0, 0.0), *_arc(radius, side)),),
    )
    radius = side / scene.curvature  # as it is measured
    ahead, behind = scene.others
    assert radius == pytest.approx(60.0, rel=0.05)
    assert ahead.s_m == pytest.approx(30.0, rel=0.06)
    assert behind.s_m == pytest.approx(-18.0, rel=0.06)
    assert ahead.d_m == pytest.approx(side * 2.0, abs=0.4)
    assert behind.d_m == pytest.approx(-side * 3.0, abs=0.4)
    assert ahead.heading_rad == pytest.approx(0.1, abs=0.05)
    assert behind.heading_rad == pytest.approx(0.0, abs=0.05)


def _arc(radius: float, side: float) -> Points:
    """From (0, 0), heading 0, a point every centimetre."""
    return tuple(
        (radius * math.sin(n * 0.01 / radius), side * radius * (1.0 - math.cos(n * 0.01 / radius))) for n in range(6000)
    )


@pytest.mark.parametrize(("turned", "curvature"), [(0.0029, 0.0), (0.0031, 0.0031 / 3.0), (-0.0031, -0.0031 / 3.0)])
def test_a_bend_of_less_than_a_thousandth_is_straight(turned: float, curvature: float) -> None:
    """What is 3 m ahead is turned by an angle."""
    bent = lane(1, (0.0, 0.0), (501.0, 0.0), (501.0 + 100.0 * math.cos(turned), 100.0 * math.sin(turned)))
    assert looked(car(0, 500.0, 0.0), lanes=(bent,)).curvature == pytest.approx(curvature)


def test_before_its_first_point_and_after_its_last_a_lane_goes_on_straight() -> None:
    bent = lane(1, (0.0, 0.0), (10.0, 0.0), (10.0, 10.0))
    before = looked(car(0, -20.0, 1.0), lanes=(bent,)).ego
    assert (before.d_m, before.heading_rad) == (pytest.approx(1.0), 0.0)
    after = looked(car(0, 11.0, 30.0, math.pi / 2.0), lanes=(bent,)).ego
    assert (after.d_m, after.heading_rad) == (pytest.approx(-1.0), pytest.approx(0.0))


@given(x=st.floats(490.0, 510.0), y=st.floats(-3.0, 3.0), heading=st.floats(-0.5, 0.5), twice=st.integers(0, 3))
def test_points_that_are_drawn_twice_do_not_count(x: float, y: float, heading: float, twice: int) -> None:
    points = ((0.0, 0.0), (498.0, 0.0), (503.0, 1.0), (2000.0, 300.0))
    doubled = (*points[: twice + 1], points[twice], *points[twice + 1 :])
    ego, other = car(0, x, y, heading), car(1, x + 9.0, y)
    once, again = looked(ego, other, lanes=(lane(1, *points),)), looked(ego, other, lanes=(lane(1, *doubled),))
    assert (again.ego, again.others, again.strips) == (once.ego, once.others, once.strips)
    assert (again.speed_limit_mps, again.curvature) == (once.speed_limit_mps, once.curvature)


@pytest.mark.parametrize("heading", [0.0, 0.3, -0.3, math.pi / 2.0, 2.5])
def test_a_body_reaches_as_far_along_and_across_as_its_corners(heading: float) -> None:
    truck = replace(car(1, 520.0, 0.0, heading), length_m=12.0, width_m=2.6)
    (other,) = looked(car(0, 500.0, 0.0), truck).others
    corners = [(a * 6.0, b * 1.3) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    c, s = math.cos(heading), math.sin(heading)
    assert other.half_length_m == pytest.approx(max(abs(c * a - s * b) for a, b in corners))
    assert other.half_width_m == pytest.approx(max(abs(s * a + c * b) for a, b in corners))


def test_only_lanes_of_the_same_road_are_beside() -> None:
    crossing = a_lane("c-d:0", ((500.0, -50.0), (500.0, 50.0)), limit=10.0)
    longer = a_lane("a-d:1", ((0.0, -8.0), (1000.0, -8.0)), limit=10.0)
    scene = looked(car(0, 500.0, 0.0), lanes=(*STRAIGHT[::-1], crossing, longer))
    assert [strip.lane for strip in scene.strips] == ["a-b:0", "a-b:1", "a-b:2"]


def test_each_lane_has_its_own_width_and_the_own_lane_its_limit() -> None:
    lanes = (lane(0, (0.0, 3.0), (9.0, 3.0), width=2.0, limit=10.0), lane(1, (0.0, 0.0), (9.0, 0.0), limit=20.0))
    scene = looked(car(0, 4.0, 0.0), lanes=lanes)
    assert scene.strips == (Strip("a-b:0", 3.0, 2.0, 4.0), Strip(OWN, 0.0, -2.0, 2.0))
    assert scene.speed_limit_mps == 20.0


def test_obstacles_are_seen_and_signs_are_not() -> None:
    post = replace(car(3, 520.0, 0.0), kind="obstacle")
    sign = replace(car(4, 520.0, 2.0), kind="stop_sign")
    shot = replace(observation(car(0, 500.0, 0.0), car(1, 510.0, 0.0)), objects=(post, sign))
    scene = ShieldLens().look(shot, OWN)
    assert scene is not None
    assert [body.id for body in scene.others] == [1, 3]


def test_without_a_lane_there_is_no_scene() -> None:
    ego = car(0, 500.0, 0.0)
    assert ShieldLens().look(observation(ego), None) is None
    assert ShieldLens().look(observation(ego), "a-b:9") is None
    assert ShieldLens().look(observation(ego, lanes=()), OWN) is None


def test_a_lens_looks_anew_for_another_lane_another_place_and_another_road() -> None:
    lens = ShieldLens()
    first = lens.look(observation(car(0, 500.0, 0.0)), OWN)
    beside = lens.look(observation(car(0, 500.0, 0.0)), "a-b:2")
    assert first is not None
    assert beside is not None
    assert (first.ego.d_m, beside.ego.d_m) == (0.0, 4.0)
    moved = tuple(replace(one, centre=Polyline.of((x, y + 1.0) for x, y in one.centre.points_m)) for one in STRAIGHT)
    there = lens.look(observation(car(0, 500.0, 0.0), lanes=moved), "a-b:2")
    assert there is not None
    assert there.ego.d_m == 3.0
    bent = (lane(2, (0.0, 0.0), (100.0, 0.0), (100.0, 100.0)),)
    for x, y, d in ((50.0, 1.0, 1.0), (101.0, 50.0, -1.0), (101.0, 80.0, -1.0)):
        found = lens.look(observation(car(0, x, y), lanes=bent), "a-b:2")
        assert found is not None
        assert found.ego.d_m == pytest.approx(d)


@given(s=st.floats(-100.0, 100.0), mine=headings, theirs=headings)
def test_a_gap_is_between_the_ends_of_bodies_as_they_are_turned(s: float, mine: float, theirs: float) -> None:
    scene = looked(car(0, 500.0, 0.0, mine), car(1, 500.0 + s, 0.0, theirs))

    def half(heading: float) -> float:
        return abs(2.5 * math.cos(heading)) + abs(math.sin(heading))

    assert scene.ego.gap_m(scene.others[0]) == pytest.approx(abs(s) - half(mine) - half(theirs))


@pytest.mark.parametrize(
    ("degrees", "crosses"), [(39.0, False), (41.0, True), (-41.0, True), (90.0, True), (139.0, True), (141.0, False)]
)
def test_what_is_turned_by_more_than_40_degrees_crosses(degrees: float, crosses: bool) -> None:
    assert looked(car(0, 500.0, 0.0, math.radians(degrees))).ego.crosses is crosses


# What is swept --------------------------------------------------------------------------------------------------------

DT = 0.1
MOST = math.pi / 4.0
SIZE = (5.0, 2.0)
SHIELDS = replace(LAMPILOT_STEERING, max_steering_rad=MOST, max_approach_rad=0.2)


def body(d: float, heading: float = 0.0) -> ShieldBody:
    return ShieldBody(0, 0.0, d, heading, 0.0, 0.0, 2.5, 1.0)


@given(speed=st.floats(0.0, 40.0), steering=st.floats(-1.0, 1.0))
def test_a_bicycle_turns_about_the_point_its_wheels_point_at(speed: float, steering: float) -> None:
    """Wheels 5 m apart, the middle of the car between them: its way has the radius 2.5 m / sin(slip)."""
    slip = math.atan(math.tan(steering) / 2.0)
    assert yaw_rate(speed, steering) == pytest.approx(speed * math.sin(slip) / 2.5)


@given(
    speed=st.floats(0.5, 40.0), d=st.floats(-4.0, 4.0), heading=st.floats(-0.5, 0.5), centre=st.floats(-4.0, 4.0),
    curvature=st.floats(-0.05, 0.05), most=st.sampled_from([0.1, MOST]),
)  # fmt: skip
def test_it_steers_back_by_lane_keeping_with_a_flat_approach(
    speed: float, d: float, heading: float, centre: float, curvature: float, most: float
) -> None:
    steering = recovery_steering(body(d, heading), centre, speed, most, curvature)
    parameters = replace(LAMPILOT_STEERING, max_steering_rad=most, max_approach_rad=0.2)
    ahead = curvature * speed * parameters.preview_s
    assert steering == lane_keeping_steering(speed, heading, d - centre, ahead, parameters)
    assert abs(steering) <= most
    plain = recovery_steering(body(d, heading), centre, speed, most)
    assert plain == lane_keeping_steering(speed, heading, d - centre, 0.0, parameters)


spans = st.builds(
    lambda d, heading, speed, steering, centre: (body(d, heading), speed, SIZE, steering, centre, MOST, DT),
    st.floats(-2.0, 2.0), st.floats(-0.5, 0.5), st.floats(0.0, 35.0), st.floats(-0.7, 0.7), st.floats(-4.0, 4.0),
)  # fmt: skip


@given(given_=spans, curvature=st.floats(-0.05, 0.05))
def test_what_is_swept_is_where_the_corners_get(
    given_: tuple[ShieldBody, float, tuple[float, float], float, float, float, float], curvature: float
) -> None:
    """Rolled on in the lane's frame, whose heading turns under the car where the lane bends."""
    ego, speed, _, steering, centre, _, _ = given_
    d, heading = ego.d_m, ego.heading_rad
    seen: list[float] = []
    for period in range(15):
        seen += [
            d + math.sin(heading) * long + math.cos(heading) * wide for long in (-2.5, 2.5) for wide in (-1.0, 1.0)
        ]
        if period and abs(heading) < 0.02 and abs(d - centre) < 0.1:
            break
        if period:
            ahead = curvature * speed * SHIELDS.preview_s
            steering = lane_keeping_steering(speed, heading, d - centre, ahead, SHIELDS)
        slip = math.atan(math.tan(steering) / 2.0)
        d += speed * math.sin(heading + slip) * DT
        heading += (yaw_rate(speed, steering) - curvature * speed) * DT
    assert swept(*given_, curvature) == pytest.approx((min(seen), max(seen)), abs=1e-9)


@given(given_=spans, curvature=st.floats(-0.05, 0.05))
def test_what_is_swept_is_to_the_last_bit_what_the_same_lines_give_in_python(
    given_: tuple[ShieldBody, float, tuple[float, float], float, float, float, float], curvature: float
) -> None:
    ego, speed, _, steering, centre, _, _ = given_
    d, heading, bend = ego.d_m, ego.heading_rad, curvature * speed
    low = high = d
    for period in range(15):
        wide = abs(math.sin(heading)) * 2.5 + abs(math.cos(heading)) * 1.0
        low, high = min(low, d - wide), max(high, d + wide)
        offset = d - centre
        if period and abs(heading) < 0.02 and abs(offset) < 0.1:
            break
        if period:
            steering = lane_keeping_steering(speed, heading, offset, bend * SHIELDS.preview_s, SHIELDS)
        slip = math.atan(0.5 * math.tan(steering))
        d += speed * math.sin(heading + slip) * DT
        heading += (speed * math.sin(slip) / 2.5 - bend) * DT
    assert swept(*given_, curvature) == (low, high)


@given(given_=spans)
def test_a_mirrored_car_sweeps_what_is_mirrored(
    given_: tuple[ShieldBody, float, tuple[float, float], float, float, float, float],
) -> None:
    ego, speed, size, steering, centre, most, dt = given_
    low, high = swept(*given_)
    mirrored = swept(body(-ego.d_m, -ego.heading_rad), speed, size, -steering, -centre, most, dt)
    assert mirrored == pytest.approx((-high, -low), abs=1e-9)


def test_a_car_in_the_middle_of_its_lane_sweeps_its_width() -> None:
    assert swept(body(0.0), 25.0, SIZE, 0.0, 0.0, MOST, DT) == (-1.0, 1.0)
    assert swept(body(0.0), 25.0, (5.0, 1.8), 0.0, 0.0, MOST, DT) == (-0.9, 0.9)


def test_it_gets_to_the_lane_it_comes_back_to() -> None:
    low, high = swept(body(0.0), 25.0, SIZE, 0.0, 4.0, MOST, DT)
    assert low < -0.9
    assert 4.5 < high < 5.5
