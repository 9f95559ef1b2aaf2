"""Everybody as rows of numbers: to the last bit what the same formulas give in plain Python."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept import LaneId, Observation, VehicleState
from chauffeur.geometry import wrap_to_pi
from chauffeur.safety.shield.frame import CROSSING_RAD, ShieldBody, ShieldLens, ShieldScene
from chauffeur.safety.shield.traffic_arrays import AHEAD, ANYWHERE, BEHIND, TrafficArrays, overlapping, placed
from roads import a_lane, a_road

OWN: LaneId = "a-b:0"
LANE = a_lane(OWN, ((0.0, 0.0), (900.0, 0.0)))
DRIFT = 0.25
SINE = math.sin(CROSSING_RAD)

places = st.floats(-90.0, 90.0)
cars = st.builds(
    VehicleState, st.integers(1, 99), st.just("car"), places, places, st.floats(-9.0, 9.0), st.floats(-3.0, 40.0),
    st.floats(0.1, 15.0), st.floats(0.1, 4.0), st.just(OWN),
)  # fmt: skip
crowds = st.lists(cars, max_size=8)


def observation(ego: VehicleState, *others: VehicleState, objects: tuple[VehicleState, ...] = ()) -> Observation:
    return Observation(0.0, 0, "highway", ego, others, objects, a_road((LANE,)), None, None, False, False)


def car(number: int, x: float, y: float, kind: Literal["car", "obstacle", "stop_sign"] = "car") -> VehicleState:
    return VehicleState(number, kind, x, y, 0.0, 10.0, 5.0, 2.0, OWN)


@given(ego=cars, others=crowds, place=st.tuples(places, places, st.floats(-4.0, 4.0)), bend=st.floats(-0.1, 0.1))
def test_rows_are_what_plain_formulas_give(
    ego: VehicleState, others: list[VehicleState], place: tuple[float, float, float], bend: float
) -> None:
    x0, y0, heading0 = place
    c0, s0 = math.cos(heading0), math.sin(heading0)
    bend = bend if abs(bend) > 1e-3 else 0.0

    def plain(one: VehicleState) -> list[float]:
        along = c0 * (one.x_m - x0) + s0 * (one.y_m - y0)
        across = -s0 * (one.x_m - x0) + c0 * (one.y_m - y0)
        turned = 0.0
        if bend:
            radius = 1.0 / bend
            side = math.copysign(1.0, radius)
            turned = side * math.atan2(along, side * (radius - across))
            along, across = turned * radius, radius - side * math.hypot(along, radius - across)
        heading = wrap_to_pi(one.heading_rad - heading0 - turned)
        c, s = math.cos(heading), math.sin(heading)
        half = one.length_m / 2.0, one.width_m / 2.0
        size = abs(c) * half[0] + abs(s) * half[1], abs(s) * half[0] + abs(c) * half[1]
        return [along, across, heading, one.speed_mps * c, one.speed_mps * s, *size, float(abs(s) > SINE)]

    everybody = TrafficArrays.of(observation(ego, *others))
    rows = placed(everybody.numbers, np.array([x0, y0, heading0, c0, s0, bend, SINE])).tolist()
    from_m = plain(ego)[0]
    assert rows == [[i, one[0] - from_m, *one[1:]] for i, one in enumerate(map(plain, (ego, *others)))]


def overlaps(other: ShieldBody, low: float, high: float, side: float) -> bool:
    left, right = other.d_m - other.half_width_m - side, other.d_m + other.half_width_m + side
    if abs(other.across_mps) > DRIFT and not other.crosses:
        left, right = (left, right + 4.0) if other.across_mps > 0.0 else (left - 4.0, right)
    return left < high and right > low


def looked(ego: VehicleState, *others: VehicleState) -> ShieldScene:
    scene = ShieldLens().look(observation(ego, *others), OWN)
    assert scene is not None
    return scene


@given(others=crowds, low=st.floats(-9.0, 9.0), wide=st.floats(0.0, 9.0), side=st.sampled_from([0.0, 0.4]))
def test_within_a_span_are_those_whose_bodies_overlap_it(
    others: list[VehicleState], low: float, wide: float, side: float
) -> None:
    scene = looked(car(0, 0.0, 0.0), *others)
    found = [other for other in scene.others if overlaps(other, low, low + wide, side)]
    span = low, low + wide
    assert scene.within(span, side, DRIFT) == found
    assert scene.within(span, side, DRIFT, AHEAD) == [one for one in found if one.s_m > 0.0]
    assert scene.within(span, side, DRIFT, BEHIND) == [one for one in found if one.s_m < 0.0]
    near = [one for one in found if scene.ego.gap_m(one) <= 20.0]
    assert scene.within(span, side, DRIFT, ANYWHERE, 20.0) == near


def test_the_ego_is_not_within_its_own_lane() -> None:
    scene = looked(car(0, 10.0, 0.0), car(7, 30.0, 0.0), car(3, 5.0, 0.0))
    assert [one.id for one in scene.within((-2.0, 2.0), 0.4, DRIFT)] == [7, 3]
    assert len(overlapping(scene.rows[:1], -2.0, 2.0, 0.4, DRIFT, 4.0, ANYWHERE, math.inf)) == 0
    assert (scene.ego.id, scene.ego.s_m) == (0, 0.0)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["x_m", "y_m", "heading_rad", "speed_mps", "length_m", "width_m"])
def test_a_number_that_is_none_is_noticed_in_anybody(name: str, wrong: float) -> None:
    ego, other, post, sign = car(0, 0.0, 0.0), car(1, 9.0, 0.0), car(2, 20.0, 0.0, "obstacle"), car(3, 9.0, 2.0)
    sign = replace(sign, kind="stop_sign")
    everybody = TrafficArrays.of(observation(ego, other, objects=(post, sign)))
    assert everybody.known
    assert [one.id for one in everybody.solid] == [0, 1, 2]
    broken = {name: wrong}
    for scene in (
        observation(replace(ego, **broken), other, objects=(post, sign)),
        observation(ego, replace(other, **broken), objects=(post, sign)),
        observation(ego, other, objects=(replace(post, **broken), sign)),
        observation(ego, other, objects=(post, replace(sign, **broken))),
    ):
        assert not TrafficArrays.of(scene).known
