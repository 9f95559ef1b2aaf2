"""Who is blamed, on scenes drawn by hand: each rule with what would turn it round."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest
from golden_sentences import compare
from hypothesis import assume, given
from hypothesis import strategies as st

from chauffeur.concept import Command, Frame, LaneId, Observation, Setpoints, VehicleState
from chauffeur.safety.blame import Blame, blame, in_the_way
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


ALONE: Scene = (body(EGO, 500.0, 0.0, 30.0), None)
CLOSING = in_lane(60.0, 60.0, 5.0, 4.0, 3.0, 0.0, ego_mps=30.0, other_mps=20.0)
FOLLOWED = in_lane(-120.0, -120.0, -5.0, -2.0, -0.1, ego_mps=15.0, other_mps=30.0)
DRIFTING = beside(1.1, 1.0, ego_heading=0.02)
COMES_OVER = (1.0, 0.5, 0.3, 0.2, 0.1, -0.1)
PASSES = [*beside(1.0, 0.3, 0.3, other_heading=-0.02, x=499.0), *beside(0.2, 0.1, -0.1, other_heading=-0.02, x=502.0)]


def braking(share: float) -> Command:
    return Command(-share * LAMPILOT_SHIELD.braking_mps2, 0.0)


def standing(speed_mps: float) -> list[Scene]:
    """The ego has come to a stand, or nearly, before it touches."""
    safe, close, (ego, other), last = in_lane(60.0, 0.3, 0.01, 0.0, ego_mps=3.0, other_mps=0.0)
    return [safe, close, (replace(ego, speed_mps=speed_mps), other), last]


def drifted(drift_mps: float, side: float) -> list[Scene]:
    heading = side * math.asin(drift_mps / 25.0)
    return [
        (body(EGO, 500.0, 0.0, 25.0, heading), body(1, 502.0, side * (2.0 + clear), 25.0))
        for clear in (1.0, 0.5, 0.3, 0.2, -0.1)
    ]


def both_came(ego_rad: float, other_rad: float, side: float) -> list[Scene]:
    return [
        (body(EGO, 500.0, 0.0, 25.0, side * ego_rad), body(1, 502.0, side * (2.0 + clear), 25.0, -side * other_rad))
        for clear in COMES_OVER
    ]


def crossing(*ego_mps: float, other_seen_from: int = 0) -> list[Scene]:
    """A car comes from the right of the picture, across the ego's lane, towards the place `x` = 510."""
    cars = [body(1, 510.0, 20.0 - tick, 10.0, -math.pi / 2.0) for tick in range(len(ego_mps))]
    return [
        (body(EGO, 510.0, 0.0, speed), one if tick >= other_seen_from else None)
        for tick, (speed, one) in enumerate(zip(ego_mps, cars, strict=True))
    ]


def oncoming(*ego_mps: float, aside_m: float = 0.0) -> list[Scene]:
    return [
        (body(EGO, 500.0, -aside_m, speed), body(1, 540.0 - 5.0 * tick, 0.0, 15.0, math.pi))
        for tick, speed in enumerate(ego_mps)
    ]


def backwards(ego_mps: float, other_mps: float, heading: float, x: float = 505.1) -> list[Scene]:
    return [(body(EGO, 500.0, 0.0, ego_mps), body(1, x - 0.02 * tick, 0.0, other_mps, heading)) for tick in range(6)]


Judged = tuple[list[Scene], Sequence[Command] | Command, str, float | None]
"""Scenes, what was applied, who is to blame, and since when."""
SCENES: dict[str, Judged] = {
    # Nobody
    "into what is not seen": ([ALONE, ALONE], COAST, "nobody", None),
    "never safe": (in_lane(1.0, 0.6, 0.2, 0.0, ego_mps=30.0), COAST, "nobody", None),
    "appears too close, and may have been safe unseen": (
        [ALONE, *in_lane(1.0, 0.5, 0.0, ego_mps=30.0)], COAST, "nobody", None,
    ),
    # Along the lane
    "follows, and does not brake": (CLOSING, COAST, "ego", 0.1),
    "follows, and brakes a period after it was too close": (CLOSING, [COAST, COAST, COAST, FULL, FULL], "other", 0.1),
    "follows, and brakes now and then": (CLOSING, [COAST, COAST, FULL, COAST, FULL], "ego", 0.1),
    "follows, and brakes nearly fully": (CLOSING, braking(0.9), "other", 0.1),
    "follows, and brakes not quite so": (CLOSING, braking(0.89), "ego", 0.1),
    "follows, and stands": (standing(0.49), COAST, "other", 0.0),
    "follows, and hardly drives": (standing(0.5), COAST, "ego", 0.0),
    "creeps, and can stop within 1.25 cm": (
        in_lane(0.05, 0.05, 0.05, 0.01, 0.01, 0.0, ego_mps=0.2, other_mps=0.0), COAST, "other", 0.2,
    ),
    "a lead that rolls back slowly": (in_lane(60.0, 0.5, 0.3, 0.0, ego_mps=3.0, other_mps=-0.5), COAST, "ego", 0.0),
    "no lead but one that comes": (in_lane(60.0, 0.5, 0.3, 0.0, ego_mps=3.0, other_mps=-0.51), COAST, "ego", None),
    "is followed, and coasts": (FOLLOWED, COAST, "other", 0.1),
    "is followed, and brakes": (FOLLOWED, FULL, "other", 0.1),
    # From the side
    "comes over": (beside(1.0, 0.5, 0.3, 0.1, -0.1, ego_heading=0.02), COAST, "ego", 0.1),
    "is come over to, and brakes": (beside(*COMES_OVER, other_heading=-0.02), FULL, "other", 0.1),
    "is come over to, and does not brake": (beside(*COMES_OVER, other_heading=-0.02), COAST, "ego", 0.1),
    "is come over to from behind": (beside(*COMES_OVER, other_heading=-0.02, x=498.0), COAST, "other", 0.1),
    "is come over to from exactly beside": (beside(*COMES_OVER, other_heading=-0.02, x=500.0), COAST, "other", 0.1),
    "is come over to from a little ahead": (beside(*COMES_OVER, other_heading=-0.02, x=500.5), COAST, "ego", 0.1),
    "is overtaken, and does not brake": (PASSES, COAST, "ego", 0.0),
    "is overtaken, and brakes once the other is ahead": (PASSES, [COAST, COAST, COAST, FULL, FULL], "other", 0.0),
    **{f"hardly drifts, to the {side}": (drifted(0.04, side), FULL, "other", 0.1) for side in (-1.0, 1.0)},
    **{f"does not drift, to the {side}": (drifted(0.0, side), FULL, "other", 0.1) for side in (-1.0, 1.0)},
    **{f"drifts, to the {side}": (drifted(0.06, side), FULL, "ego", 0.1) for side in (-1.0, 1.0)},
    "came farther since they were apart for the last time": (
        [*beside(1.0, 0.6, 0.3, ego_heading=0.04), *beside(0.3, 0.2, -0.1, other_heading=-0.01)], FULL, "ego", 0.1,
    ),
    "came farther before they were apart for the last time": (
        [*beside(1.0, 0.6, ego_heading=0.04), *beside(0.5, 0.3, 0.2, -0.1, other_heading=-0.01)], FULL, "other", 0.2,
    ),
    "came farther until their sides met": (
        [*beside(0.9, 0.45, 0.3, other_heading=-0.01), *beside(0.2, 0.1, 0.05, -0.1, ego_heading=0.04)], FULL, "ego",
        0.1,
    ),
    "is thrown over once their sides have met": (
        [*beside(0.5, 0.3, -0.1, other_heading=-0.02), *beside(-0.2, -0.3, -0.4, -0.4, ego_heading=0.4)], FULL,
        "other", 0.0,
    ),
    **{f"both come over, the ego faster, to the {side}": (both_came(0.1, 0.05, side), FULL, "ego", 0.0)
       for side in (-1.0, 1.0)},
    **{f"both come over, the other faster, to the {side}": (both_came(0.05, 0.1, side), FULL, "other", 0.0)
       for side in (-1.0, 1.0)},
    "is come over to in the very last period": (
        [*DRIFTING, *beside(0.3, ego_heading=0.0, other_heading=-0.2)], FULL, "other", 0.1,
    ),
    "comes over in the very last period": (
        [*DRIFTING, *beside(0.3, ego_heading=0.2, other_heading=-0.02)], FULL, "ego", 0.1,
    ),
    # Where ways cross
    "crosses the way of another": (crossing(*[8.0] * 6), COAST, "ego", None),
    "stood in the way, and set out": (crossing(*[0.0] * 5, 0.6, 0.6), COAST, "ego", None),
    "stood in the way of one not yet seen": (crossing(8.0, 0.0, 0.0, 0.0, 0.0, other_seen_from=3), COAST, "ego", None),
    "brakes for one that comes towards it": (oncoming(*[10.0] * 6), FULL, "ego", None),
    "stood clear": (oncoming(*[0.0] * 6, aside_m=3.0), COAST, "other", 0.0),
    "came to stand clear": (oncoming(5.0, 5.0, 0.49, 0.49, 0.49, 0.49, aside_m=3.0), COAST, "other", 0.2),
    "came to stand clear, and moved": (oncoming(5.0, 5.0, 0.0, 0.0, 0.5, 0.0, aside_m=3.0), COAST, "ego", None),
    "reverses into one that crosses": (
        [(body(EGO, 503.0 - t, 0.0, -6.0), body(1, 496.0, -9.0 + t, 8.0, math.pi / 2.0)) for t in (0.0, 1.0, 2.0)],
        COAST, "ego", None,
    ),
    # Backwards
    "stands, and is reversed into": (backwards(0.0, -0.6, 0.0), COAST, "other", 0.4),
    "stands, and is reversed into at an angle": (backwards(0.0, -0.2, 0.3), COAST, "other", 0.4),
    "rolls towards one that reverses": (backwards(0.5, -0.6, 0.0), COAST, "ego", None),
    "stands before one that drives towards it": (backwards(0.0, 0.6, math.pi), COAST, "ego", None),
    **{f"reverses at {speed} m/s": (
        in_lane(-9.0, -6.0, -3.0, -1.0, -0.1, -0.001, ego_mps=speed, other_mps=0.0), COAST, "ego", since,
    ) for speed, since in ((-0.3, 0.4), (-2.0, 0.3), (-6.0, 0.2))},
    "rolls back a little, and is run into": (
        in_lane(-60.0, -10.0, -6.0, -2.0, ego_mps=-0.2, other_mps=20.0), COAST, "other", 0.0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_who_is_to_blame_since_when(name: str) -> None:
    scenes, applied, who, since_s = SCENES[name]
    found = judged(scenes, applied)
    assert (found.who, found.since_s) == (who, None if since_s is None else pytest.approx(since_s))


def test_what_is_said_of_blame() -> None:
    found = {name: judged(scenes, applied) for name, (scenes, applied, *_) in SCENES.items()}
    unhurt = blame([frame(instant(tick, one)) for tick, one in enumerate(CLOSING)], instant(6, CLOSING[0]), DT)
    at_once = blame([], instant(0, in_lane(0.0)[0], crashed=True), DT)
    found |= {"did not crash": unhurt, "crashed in the first instant": at_once}
    assert (unhurt.who, unhurt.other, at_once.who, at_once.other) == ("nobody", None, "nobody", 1)
    compare("blame", {name: [one.who, one.reason] for name, one in found.items()})


@pytest.mark.parametrize(("x", "heading"), [(495.0, 0.0), (505.0, math.pi / 2.0)])
def test_who_rolls_away_or_across_backwards_does_not_reverse_into_the_ego(x: float, heading: float) -> None:
    scenes: list[Scene] = [(body(EGO, 500.0, 0.0, 0.0), body(1, x, 0.0, -0.6, heading)) for _ in range(6)]
    assert judged(scenes).reason != judged(backwards(0.0, -0.6, 0.0)).reason


def test_an_ego_in_no_lane_is_judged_by_what_was_seen_before() -> None:
    def off(scene: Scene) -> Scene:
        ego, other = scene
        return replace(ego, lane=None), other

    safe, close, touch = in_lane(60.0, 5.0, 0.0, ego_mps=30.0)
    assert judged([off(safe), off(close), off(touch)]).who == "nobody"
    found = judged([safe, off(close), close, off(close), close, off(touch)])
    assert (found.who, found.since_s) == ("ego", 0.0)


def test_where_in_its_lane_the_ego_drives_does_not_matter() -> None:
    def shifted(scenes: list[Scene]) -> list[Scene]:
        return [
            (replace(ego, y_m=ego.y_m + 1.0), None if other is None else replace(other, y_m=other.y_m + 1.0))
            for ego, other in scenes
        ]

    for scenes in (beside(1.0, 0.5, 0.3, -0.1, ego_heading=0.02), in_lane(60.0, 5.0, 4.0, 3.0, 0.0, ego_mps=30.0)):
        assert judged(shifted(scenes)) == judged(scenes)


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
    assert in_the_way(ego, other) is (apart < 0.0)


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
    final = replace(final, ego=replace(final.ego, crashed=True))
    struck = blame([], final, DT).other
    assert struck is not None
    assert math.hypot(*places[struck - 1]) == pytest.approx(min(math.hypot(x, y) for x, y in places))


def test_one_that_is_gone_at_the_end_is_known_from_the_last_period() -> None:
    safe, close = in_lane(60.0, 5.0, ego_mps=30.0)
    frames = [frame(instant(0, safe)), frame(instant(1, close)), frame(instant(2, close, crashed=True))]
    found = blame(frames, instant(3, (replace(close[0], crashed=True), None), crashed=True), DT)
    assert (found.who, found.other) == ("ego", 1)
