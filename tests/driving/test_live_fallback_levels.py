"""The ladder of fallbacks, level by level."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept import Limits, Observation, Setpoints, VehicleState
from chauffeur.driving.live.fallback_levels import FALLBACK_LEVELS, FallbackLevels, FallbackTimings
from chauffeur.driving.live.messages import LiveSetpoints
from chauffeur.safety.bounds import bounded
from roads import a_lane, a_road

WISHES = Setpoints(target_speed_mps=30.0, time_headway_s=1.0, target_lane="a-b:1")


def wish(state: str = "running") -> LiveSetpoints:
    return LiveSetpoints(1, 0, "w1", 0, 1, state, None, WISHES)  # pyright: ignore[reportArgumentType]


def observation(speed_mps: float = 25.0, lane: int = 1, lanes: int = 3, shoulder: bool = False) -> Observation:
    views = tuple(
        a_lane(f"a-b:{k}", ((0.0, 4.0 * k), (1000.0, 4.0 * k)), limit=31.0, emergency=shoulder and k == lanes - 1)
        for k in range(lanes)
    )
    ego = VehicleState(0, "car", 0.0, 4.0 * lane, 0.0, speed_mps, 5.0, 2.0, f"a-b:{lane}")
    return Observation(0.0, 0, "highway", ego, (), (), a_road(views), None, None, False, False)


def test_a_fresh_wish_is_followed_an_older_one_held_and_then_let_go_of() -> None:
    ladder, table = FallbackLevels(), FallbackTimings()
    assert ladder.choose(0.0, wish(), table.fresh_s, observation()) == ("follow", WISHES)
    assert ladder.choose(0.1, wish(), table.fresh_s + 0.01, observation()) == ("hold", WISHES)
    assert ladder.choose(0.2, wish(), table.hold_s, observation()) == ("hold", WISHES)
    level, safe = ladder.choose(0.3, wish(), table.hold_s + 0.01, observation(25.0, lane=2))
    assert level == "keep"
    assert (safe.target_speed_mps, safe.time_headway_s, safe.target_lane) == (25.0, 2.0, "a-b:2")


def test_rungs_follow_one_another_and_a_fresh_wish_leads_back() -> None:
    ladder, table = FallbackLevels(), FallbackTimings()
    seen: list[str] = []
    speed = 25.0
    for k in range(400):
        at_s = 0.1 * k
        level, setpoints = ladder.choose(at_s, wish(), at_s, observation(speed))
        assert setpoints.target_speed_mps is not None
        speed += max(-0.3, min(0.0, setpoints.target_speed_mps - speed))
        if not seen or seen[-1] != level:
            seen.append(level)
    assert seen == list(FALLBACK_LEVELS)
    assert speed == pytest.approx(0.0)
    assert ladder.choose(40.0, wish(), 0.0, observation(speed)) == ("follow", WISHES)
    assert ladder.choose(40.1, wish(), table.hold_s + 1.0, observation(10.0))[0] == "keep"  # from the top of the ladder


@pytest.mark.parametrize(("state", "expired"), [("failed", False), ("running", True)])
def test_wishes_of_a_plan_that_failed_or_expired_are_not_held(state: str, expired: bool) -> None:
    level, safe = FallbackLevels().choose(0.0, wish(state), 0.0, observation(20.0), expired=expired)
    assert level == "keep"
    assert safe.target_speed_mps == 20.0


def test_without_any_wish_ever_lane_and_gap_are_kept() -> None:
    level, safe = FallbackLevels().choose(5.0, None, 5.0, observation(20.0))
    assert (level, safe.target_speed_mps, safe.time_headway_s) == ("keep", 20.0, 2.0)


def test_a_car_that_gathers_speed_while_it_keeps_is_still_asked_for_what_it_had() -> None:
    ladder = FallbackLevels()
    assert ladder.choose(5.0, None, 5.0, observation(20.0))[1].target_speed_mps == 20.0
    assert ladder.choose(5.1, None, 5.1, observation(22.0))[1].target_speed_mps == 20.0


def test_the_shoulder_is_made_for_one_lane_at_a_time_and_stood_on() -> None:
    ladder, table = FallbackLevels(), FallbackTimings()
    ladder.choose(0.0, None, 10.0, observation(5.0, lane=0, shoulder=True))
    at_s = table.keep_s
    for lane, towards in ((0, 1), (1, 2)):
        level, setpoints = ladder.choose(at_s, None, 10.0, observation(5.0, lane=lane, shoulder=True))
        assert (level, setpoints.target_lane) == ("slow", f"a-b:{towards}")
    level, setpoints = ladder.choose(at_s, None, 10.0, observation(5.0, lane=2, shoulder=True))
    assert (level, setpoints.target_lane, setpoints.target_speed_mps) == ("stop", "a-b:2", 0.0)
    late = at_s + table.slow_s
    assert ladder.choose(late, None, 30.0, observation(5.0, lane=0, shoulder=True))[0] == "stop"  # it never got there


@given(
    st.one_of(st.none(), st.floats(allow_nan=True, allow_infinity=True)),
    st.floats(allow_nan=True, allow_infinity=True),
    st.floats(0.0, 40.0),
    st.one_of(st.none(), st.floats(0.0, 50.0)),
)
def test_bounded_wishes_are_within_the_limits(
    speed: float | None, headway: float, limit: float, most: float | None
) -> None:
    limits = Limits(max_speed_mps=most)
    asked = Setpoints(speed, headway, "a-b:0")
    got, changed = bounded(asked, limits, limit)
    top = min(limit + limits.max_over_limit_mps, 1e9 if most is None else most)
    assert got.target_speed_mps is None or 0.0 <= got.target_speed_mps <= top
    assert limits.min_time_headway_s <= got.time_headway_s <= limits.max_time_headway_s
    assert got.target_lane == asked.target_lane
    assert ("target_speed" in changed) == (got.target_speed_mps != speed)
    assert ("time_headway" in changed) == (got.time_headway_s != headway)
    assert bounded(got, limits, limit) == (got, ())
