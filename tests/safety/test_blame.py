"""Who is blamed, on scenes drawn by hand: each rule with what would turn it round."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from chauffeur.concept import Command, Frame, LaneId, Observation, Setpoints, VehicleState
from chauffeur.safety.blame import Blame, _in_the_way, _struck, blame
from chauffeur.safety.shield import LAMPILOT_SHIELD
from chauffeur.worlds.base import EGO
from roads import a_lane, a_road

DT = 0.1
COAST, FULL = Command(0.0, 0.0), Command(-8.0, 0.0)
LANES = tuple(a_lane(f"a-b:{2 - i}", ((0.0, 4.0 * i), (2000.0, 4.0 * i))) for i in range(3))
OWN: LaneId = "a-b:1"


def body(number: int, x: float, y: float, speed: float, heading: float = 0.0) -> VehicleState:
    """A car `y` metres to the left of the middle lane's centre."""
    return VehicleState(number, "car", x, 4.0 + y, heading, speed, 5.0, 2.0, OWN)


Scene = tuple[VehicleState, VehicleState | None]


def instant(tick: int, scene: Scene, crashed: bool = False) -> Observation:
    ego, other = (None if one is None else replace(one, crashed=crashed) for one in scene)
    assert ego is not None
    others = () if other is None else (other,)
    return Observation(tick * DT, tick, "highway", ego, others, (), a_road(LANES), None, None, False, False)


def frame(observation: Observation, applied: Command = COAST) -> Frame:
    return Frame(observation, Setpoints(), applied, applied, "none", None, (), (), ())


def judged(scenes: Sequence[Scene], applied: Sequence[Command] | Command = COAST) -> Blame:
    """The blame for a collision in the last of some scenes, one a period."""
    commands = [applied] * len(scenes) if isinstance(applied, Command) else applied
    frames = [
        frame(instant(tick, scene), command)
        for tick, (scene, command) in enumerate(zip(scenes[:-1], commands, strict=False))
    ]
    found = blame(frames, instant(len(scenes) - 1, scenes[-1], crashed=True), DT)
    assert found.other == 1 or all(other is None for _, other in scenes)
    return found


def in_lane(*gaps_m: float, ego_mps: float = 25.0, other_mps: float = 25.0) -> list[Scene]:
    """The other ahead in the ego's lane (behind: gaps below 0), by clear distances."""
    return [
        (body(EGO, 500.0, 0.0, ego_mps), body(1, 500.0 + gap + math.copysign(5.0, gap), 0.0, other_mps))
        for gap in gaps_m
    ]


def beside(*clear_m: float, ego_heading: float = 0.0, other_heading: float = 0.0, x: float = 502.0) -> list[Scene]:
    """The other to the left of the ego, by clear distances to the side; its heading 0 along the road."""
    return [
        (body(EGO, 500.0, 0.0, 25.0, ego_heading), body(1, x, 2.0 + clear, 25.0, other_heading)) for clear in clear_m
    ]


# Nobody ---------------------------------------------------------------------------------------------------------------


def test_without_a_collision_nobody_is_blamed() -> None:
    frames = [frame(instant(tick, scene)) for tick, scene in enumerate(in_lane(-1.0, 0.1))]
    assert blame(frames, instant(2, in_lane(0.1)[0]), DT) == Blame("nobody", None, None, "There was no collision.")


def test_who_ran_into_what_is_not_seen_is_blamed_for_nothing() -> None:
    alone: Scene = (body(EGO, 500.0, 0.0, 25.0), None)
    assert judged([alone, alone]) == Blame("nobody", None, None, "The ego crashed, but into nobody that is seen.")


def test_without_any_period_before_nobody_is_blamed() -> None:
    found = blame([], instant(0, in_lane(0.0)[0], crashed=True), DT)
    assert found == Blame("nobody", 1, None, "They were never seen at a safe distance.")


def test_what_was_never_safe_is_nobodys() -> None:
    found = judged(in_lane(1.0, 0.6, 0.2, 0.0, ego_mps=30.0))
    assert (found.who, found.other, found.since_s) == ("nobody", 1, None)


def test_one_that_appears_too_close_was_never_safe() -> None:
    """Whether it was safe while it was not seen cannot be said."""
    alone: Scene = (body(EGO, 500.0, 0.0, 30.0), None)
    found = judged([alone, *in_lane(1.0, 0.5, 0.0, ego_mps=30.0)])
    assert (found.who, found.other, found.since_s) == ("nobody", 1, None)


def test_an_ego_in_no_lane_is_judged_by_what_was_seen_before() -> None:
    def off(scene: Scene) -> Scene:
        ego, other = scene
        return replace(ego, lane=None), other

    safe, close, touch = in_lane(60.0, 5.0, 0.0, ego_mps=30.0)
    assert judged([off(safe), off(close), off(touch)]).who == "nobody"
    found = judged([safe, off(close), close, off(close), close, off(touch)])
    assert (found.who, found.since_s) == ("ego", 0.0)


# Along the lane -------------------------------------------------------------------------------------------------------


def test_the_follower_is_to_blame_who_did_not_brake_with_all_it_has() -> None:
    scenes = in_lane(60.0, 60.0, 5.0, 4.0, 3.0, 0.0, ego_mps=30.0, other_mps=20.0)
    found = judged(scenes)
    assert (found.who, found.other, found.since_s) == ("ego", 1, pytest.approx(0.1))
    assert found.reason == "The ego followed too closely."
    # the first unsafe period is for noticing
    assert judged(scenes, [COAST, COAST, COAST, FULL, FULL]).who == "other"
    assert judged(scenes, [COAST, COAST, FULL, COAST, FULL]).who == "ego"


def test_nine_tenths_of_full_braking_count_as_full() -> None:
    scenes = in_lane(60.0, 5.0, 4.0, 3.0, 0.0, ego_mps=30.0, other_mps=20.0)
    enough = Command(-0.9 * LAMPILOT_SHIELD.braking_mps2, 0.0)
    assert judged(scenes, enough).reason == "The other ahead braked harder than anyone may be expected to."
    assert judged(scenes, Command(-0.89 * LAMPILOT_SHIELD.braking_mps2, 0.0)).who == "ego"


def test_an_ego_that_stands_need_not_brake() -> None:
    safe, close, touching, last = in_lane(60.0, 0.3, 0.01, 0.0, ego_mps=3.0, other_mps=0.0)
    for speed_mps, who in ((0.49, "other"), (0.5, "ego")):
        found = judged([safe, close, (replace(touching[0], speed_mps=speed_mps), touching[1]), last])
        assert (found.who, found.since_s) == (who, 0.0)


def test_a_car_that_creeps_is_safe_as_near_as_it_can_stop() -> None:
    """0.2 m/s are braked within 1.25 cm."""
    found = judged(in_lane(0.05, 0.05, 0.05, 0.01, 0.01, 0.0, ego_mps=0.2, other_mps=0.0))
    assert (found.who, found.since_s) == ("other", pytest.approx(0.2))


def test_one_that_rolls_back_slowly_is_a_lead_and_none_that_comes_towards_the_ego() -> None:
    rolling = [judged(in_lane(60.0, 0.5, 0.3, 0.0, ego_mps=3.0, other_mps=speed)) for speed in (-0.5, -0.51)]
    assert [found.since_s for found in rolling] == [0.0, None]


def test_who_follows_the_ego_too_closely_is_to_blame_whatever_the_ego_did() -> None:
    scenes = in_lane(-120.0, -120.0, -5.0, -2.0, -0.1, ego_mps=15.0, other_mps=30.0)
    for applied in (COAST, FULL):
        found = judged(scenes, applied)
        assert (found.who, found.since_s) == ("other", pytest.approx(0.1))
        assert found.reason == "The other followed too closely."


# From the side --------------------------------------------------------------------------------------------------------


def test_the_ego_that_comes_over_is_to_blame() -> None:
    found = judged(beside(1.0, 0.5, 0.3, 0.1, -0.1, ego_heading=0.02))
    assert (found.who, found.since_s) == ("ego", pytest.approx(0.1))
    assert found.reason == "The ego came over to the other's side."


def test_the_other_that_comes_over_is_to_blame_if_the_ego_braked() -> None:
    scenes = beside(1.0, 0.5, 0.3, 0.2, 0.1, -0.1, other_heading=-0.02)
    found = judged(scenes, FULL)
    assert (found.who, found.since_s) == ("other", pytest.approx(0.1))
    assert found.reason == "The other came over to the ego's side."
    why = "The other came over, but the ego did not brake with all it has."
    assert judged(scenes, COAST) == Blame("ego", 1, pytest.approx(0.1), why)


def test_one_that_comes_over_from_behind_need_not_be_braked_for() -> None:
    found = judged(beside(1.0, 0.5, 0.3, 0.2, 0.1, -0.1, other_heading=-0.02, x=498.0), COAST)
    assert (found.who, found.reason) == ("other", "The other came over to the ego's side.")


@pytest.mark.parametrize(("x", "who"), [(500.0, "other"), (500.5, "ego")])
def test_one_exactly_beside_need_not_be_braked_for_and_one_a_little_ahead_does(x: float, who: str) -> None:
    scenes = beside(1.0, 0.5, 0.3, 0.2, 0.1, -0.1, other_heading=-0.02, x=x)
    assert judged(scenes, COAST).who == who


def test_one_that_overtakes_and_comes_over_has_to_be_braked_for_once_it_is_ahead() -> None:
    came = beside(1.0, 0.3, 0.3, other_heading=-0.02, x=499.0)
    ahead = beside(0.2, 0.1, -0.1, other_heading=-0.02, x=502.0)
    assert judged([*came, *ahead], COAST).who == "ego"
    assert judged([*came, *ahead], [COAST, COAST, COAST, FULL, FULL]).who == "other"


def test_where_in_its_lane_the_ego_drives_does_not_matter() -> None:
    def shifted(scenes: list[Scene]) -> list[Scene]:
        return [
            (replace(ego, y_m=ego.y_m + 1.0), None if other is None else replace(other, y_m=other.y_m + 1.0))
            for ego, other in scenes
        ]

    for scenes in (beside(1.0, 0.5, 0.3, -0.1, ego_heading=0.02), in_lane(60.0, 5.0, 4.0, 3.0, 0.0, ego_mps=30.0)):
        assert judged(shifted(scenes)) == judged(scenes)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(("drift_mps", "who"), [(0.0, "other"), (0.04, "other"), (0.06, "ego")])
def test_who_hardly_drifts_did_not_come_over(side: float, drift_mps: float, who: str) -> None:
    heading = side * math.asin(drift_mps / 25.0)
    scenes: list[Scene] = [
        (body(EGO, 500.0, 0.0, 25.0, heading), body(1, 502.0, side * (2.0 + clear), 25.0))
        for clear in (1.0, 0.5, 0.3, 0.2, -0.1)
    ]
    assert judged(scenes, FULL).who == who


def test_who_came_over_is_counted_from_when_they_were_apart_for_the_last_time() -> None:
    first = beside(1.0, 0.6, 0.3, ego_heading=0.04)
    then = beside(0.3, 0.2, -0.1, other_heading=-0.01)
    assert judged([*first, *then], FULL).who == "ego"
    assert judged([*beside(1.0, 0.6, ego_heading=0.04), *beside(0.5, 0.3, 0.2, -0.1, other_heading=-0.01)], FULL) == (
        Blame("other", 1, pytest.approx(0.2), "The other came over to the ego's side.")
    )


def test_who_came_over_is_counted_until_their_sides_meet() -> None:
    first = beside(0.9, 0.45, 0.3, other_heading=-0.01)
    then = beside(0.2, 0.1, 0.05, -0.1, ego_heading=0.04)
    assert judged([*first, *then], FULL).who == "ego"


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_of_two_that_come_over_the_faster_one_is_to_blame(side: float) -> None:
    def scenes(ego_rad: float, other_rad: float) -> list[Scene]:
        return [
            (
                body(EGO, 500.0, 0.0, 25.0, side * ego_rad),
                body(1, 502.0, side * (2.0 + clear), 25.0, -side * other_rad),
            )
            for clear in (1.0, 0.5, 0.3, 0.2, 0.1, -0.1)
        ]

    assert judged(scenes(0.1, 0.05), FULL).who == "ego"
    assert judged(scenes(0.05, 0.1), FULL).who == "other"


def test_who_comes_over_in_the_very_last_period_is_to_blame() -> None:
    """The ego drifted a little within its lane; the other left its own at once, and that is seen at the end alone."""
    drifting = [*beside(1.1, ego_heading=0.02), *beside(1.0, ego_heading=0.02)]
    assert judged([*drifting, *beside(0.3, ego_heading=0.0, other_heading=-0.2)], FULL).who == "other"
    assert judged([*drifting, *beside(0.3, ego_heading=0.2, other_heading=-0.02)], FULL).who == "ego"


def test_what_each_does_after_their_sides_met_does_not_count() -> None:
    """The other came over; that the ego is then thrown over to it is no fault of the ego's."""
    came = beside(0.5, 0.3, -0.1, other_heading=-0.02)
    thrown = beside(-0.2, -0.3, -0.4, -0.4, ego_heading=0.4)
    assert judged([*came, *thrown], FULL).who == "other"


# Where ways cross -----------------------------------------------------------------------------------------------------


def crossing(ego_mps: Sequence[float], ego_y: float, other_seen_from: int = 0) -> Blame:
    """A car comes from the right of the picture, across the ego's lane, towards the place `x` = 510."""
    scenes: list[Scene] = []
    for tick, speed in enumerate(ego_mps):
        ego = body(EGO, 510.0, ego_y, speed)
        other = body(1, 510.0, 20.0 - tick, 10.0, -math.pi / 2.0)
        scenes.append((ego, other if tick >= other_seen_from else None))
    return judged(scenes)


def test_where_ways_cross_an_ego_that_moves_is_to_blame() -> None:
    assert crossing([8.0] * 6, 0.0) == Blame("ego", 1, None, "The ego was in the way of one that crossed.")
    assert crossing([0.0] * 5 + [0.6, 0.6], 0.0).who == "ego"


def test_where_ways_cross_one_that_was_not_there_when_the_ego_came_to_stand_goes_first() -> None:
    assert crossing([8.0, 0.0, 0.0, 0.0, 0.0], 0.0, other_seen_from=3).who == "ego"


def test_one_that_comes_towards_the_ego_goes_first() -> None:
    scenes: list[Scene] = [
        (body(EGO, 500.0, 0.0, 10.0), body(1, 540.0 - 5.0 * tick, 0.0, 15.0, math.pi)) for tick in range(6)
    ]
    assert judged(scenes, FULL).who == "ego"


def test_an_ego_that_stands_clear_of_the_way_is_not_to_blame_from_when_it_stood() -> None:
    def aside(*speeds_mps: float) -> Blame:
        return judged(
            [
                (body(EGO, 500.0, -3.0, speed), body(1, 540.0 - 5.0 * tick, 0.0, 15.0, math.pi))
                for tick, speed in enumerate(speeds_mps)
            ]
        )

    why = "The ego stood clear of the way of the one that ran into it."
    assert aside(0.0, 0.0, 0.0, 0.0, 0.0, 0.0) == Blame("other", 1, 0.0, why)
    found = aside(5.0, 5.0, 0.49, 0.49, 0.49, 0.49)
    assert (found.who, found.since_s) == ("other", pytest.approx(0.2))
    assert aside(5.0, 5.0, 0.0, 0.0, 0.5, 0.0).who == "ego"


@pytest.mark.parametrize(
    ("ego_mps", "other_mps", "heading", "who"),
    [
        (0.0, -0.6, 0.0, "other"),
        (0.0, -0.2, 0.3, "other"),
        (0.5, -0.6, 0.0, "ego"),  # still rolls towards it
        (0.0, 0.6, math.pi, "ego"),  # drives towards the ego, and does not reverse
    ],
)
def test_who_reverses_into_an_ego_that_stands_is_to_blame(
    ego_mps: float, other_mps: float, heading: float, who: str
) -> None:
    scenes: list[Scene] = [
        (body(EGO, 500.0, 0.0, ego_mps), body(1, 505.1 - 0.02 * tick, 0.0, other_mps, heading)) for tick in range(6)
    ]
    found = judged(scenes)
    assert found.who == who
    assert ("reversed" in found.reason) == (who == "other")


@pytest.mark.parametrize("speed", [-0.3, -2.0, -6.0])
def test_an_ego_that_reverses_into_one_behind_is_to_blame(speed: float) -> None:
    scenes = in_lane(-9.0, -6.0, -3.0, -1.0, -0.1, -0.001, ego_mps=speed, other_mps=0.0)
    assert judged(scenes).who == "ego"
    assert judged(scenes).reason == "The ego reversed into the one behind."


def test_one_that_runs_into_an_ego_rolling_back_a_little_is_to_blame() -> None:
    assert judged(in_lane(-60.0, -10.0, -6.0, -2.0, ego_mps=-0.2, other_mps=20.0)).who == "other"


def test_an_ego_that_reverses_into_one_that_crosses_does_not_stand() -> None:
    scenes = [
        (body(EGO, 500.0 + 3.0 - t, 0.0, -6.0), body(1, 496.0, -9.0 + t, 8.0, math.pi / 2.0)) for t in (0.0, 1.0, 2.0)
    ]
    assert judged(scenes).who == "ego"


@pytest.mark.parametrize(("x", "heading"), [(495.0, 0.0), (505.0, math.pi / 2.0)])
def test_who_rolls_away_or_across_backwards_does_not_reverse_into_the_ego(x: float, heading: float) -> None:
    scenes: list[Scene] = [(body(EGO, 500.0, 0.0, 0.0), body(1, x, 0.0, -0.6, heading)) for _ in range(6)]
    assert "reversed" not in judged(scenes).reason


@given(
    x=st.floats(-20.0, 20.0), y=st.floats(-6.0, 6.0), heading=st.floats(-3.0, 3.0), turned=st.floats(-3.0, 3.0),
    place=st.floats(-100.0, 100.0), wide=st.floats(1.5, 3.0),
)  # fmt: skip
def test_the_ego_is_in_the_way_if_a_corner_of_it_is(
    x: float, y: float, heading: float, turned: float, place: float, wide: float
) -> None:
    """`x` and `y` from the other, along and across its way: no matter how that way lies in the world."""
    c, s = math.cos(heading), math.sin(heading)
    other = VehicleState(1, "car", place, -place, heading, 8.0, 5.0, wide, None)
    ego = VehicleState(0, "car", place + c * x - s * y, -place + s * x + c * y, heading + turned, 0.0, 4.6, 1.8, None)
    across = [y + math.sin(turned) * long + math.cos(turned) * side for long in (-2.3, 2.3) for side in (-0.9, 0.9)]
    apart = max(min(across) - wide / 2.0, -wide / 2.0 - max(across))
    assume(abs(apart) > 1e-9)
    assert _in_the_way(ego, other) is (apart < 0.0)


# Which of several -----------------------------------------------------------------------------------------------------


def test_of_several_that_crashed_the_nearest_is_meant() -> None:
    scenes = in_lane(60.0, 5.0, 0.0, ego_mps=30.0)
    final = instant(2, scenes[2], crashed=True)
    far = body(7, 900.0, 0.0, 0.0)
    wreck = replace(far, crashed=True)
    frames = [
        frame(replace(instant(tick, scene), others=(*instant(tick, scene).others, far)))
        for tick, scene in enumerate(scenes[:2])
    ]
    assert blame(frames, replace(final, others=(wreck, *final.others)), DT).other == 1
    assert blame(frames, replace(final, others=(), objects=(replace(wreck, kind="obstacle"),)), DT).other == 7


@given(places=st.lists(st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0)), min_size=1, max_size=4))
def test_who_was_struck_is_the_nearest_that_crashed(places: list[tuple[float, float]]) -> None:
    cars = [replace(body(number, 500.0 + x, y, 5.0), crashed=True) for number, (x, y) in enumerate(places, start=1)]
    whole = replace(body(99, 500.0, 0.1, 5.0), crashed=False)
    final = replace(instant(0, (body(EGO, 500.0, 0.0, 5.0), None)), others=(whole, *cars))
    struck = _struck(final)
    assert struck is not None
    assert math.hypot(*places[struck - 1]) == pytest.approx(min(math.hypot(x, y) for x, y in places))


def test_one_that_is_gone_at_the_end_is_known_from_the_last_period() -> None:
    safe, close = in_lane(60.0, 5.0, ego_mps=30.0)
    frames = [frame(instant(0, safe)), frame(instant(1, close)), frame(instant(2, close, crashed=True))]
    found = blame(frames, instant(3, (replace(close[0], crashed=True), None), crashed=True), DT)
    assert (found.who, found.other) == ("ego", 1)
