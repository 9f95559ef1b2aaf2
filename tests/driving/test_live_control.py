"""The control process in one piece, with a clock made by hand: what it believes, follows and falls back to."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from live_bench import DT_NS, OVERTAKE, Bench

from chauffeur.concept import DataError, Limits, Setpoints
from chauffeur.driving.live.control import AHEAD_NS, run
from chauffeur.driving.live.messages import MirroredInstant, Report
from chauffeur.driving.live.mirror import Mirror
from chauffeur.driving.live.realtime import Ticker, punctuality
from chauffeur.driving.live.starts import Start
from chauffeur.driving.scenarios import find
from chauffeur.worlds.highway import HighwayWorld


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    made = Bench(tmp_path, (OVERTAKE,))
    made.control.begin_trip()
    yield made
    for ring in (made.setpoints, made.observations, made.reports):
        ring.close()


def test_a_fresh_wish_is_driven_and_reported(bench: Bench) -> None:
    first = bench.tick()
    assert (first.level, first.plan, first.tick) == ("hold", "", 0)
    wished = Setpoints(20.0, 1.5, bench.world.perception().lane_of(0))
    for _ in range(5):
        bench.wish(wished)
        report = bench.tick()
    assert (report.level, report.plan, report.state, report.line) == ("follow", "w1", "running", 1)
    assert report.age_s == pytest.approx(0.1)
    assert report.setpoints == wished
    assert report.requested.acceleration_mps2 < 0.0
    message = bench.reports.latest()
    assert message is not None
    assert Report.decode(message.payload) == report


def test_a_world_elsewhere_can_be_at_the_instant_shown(bench: Bench) -> None:
    mirror = Mirror(HighwayWorld(), (OVERTAKE,), bench.observations)
    assert mirror.follow()
    assert mirror.world.observe() == bench.world.observe()
    assert not mirror.follow()  # nothing new
    for _ in range(20):
        bench.tick()
    assert mirror.follow()
    assert (mirror.trip, mirror.tick) == (1, 20)
    assert mirror.world.observe() == bench.world.observe()
    assert mirror.world.perception().front_blocker(frozenset()) == bench.world.perception().front_blocker(frozenset())


def test_an_observation_that_is_none_leaves_the_copy_as_it_was(bench: Bench) -> None:
    mirror = Mirror(HighwayWorld(), (OVERTAKE,), bench.observations)
    mirror.follow()
    before = mirror.world.observe()
    for bad in (b"", b"x" * 40, MirroredInstant(1, 5, b"short").encode(), MirroredInstant(9, 0, b"").encode()):
        bench.observations.write(bad)
        assert not mirror.follow()
    assert mirror.world.observe() == before
    with pytest.raises(DataError):
        mirror.world.adopt(b"1234")


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"trip": 2}, "another trip"),
        ({"tick": 50}, "an instant to come"),
        ({"issued_ns": 1_000_000_000 + 2 * DT_NS + 2 * AHEAD_NS}, "issued in the future"),
        ({"setpoints": Setpoints(20.0, 1.5, "no-such:0")}, "no such lane"),
    ],
)
def test_a_wish_that_cannot_be_meant_for_now_is_refused_and_counted(
    bench: Bench, changes: dict[str, object], why: str
) -> None:
    bench.wish(Setpoints(20.0), **changes)
    report = bench.tick()
    assert report.refused == {why: 1}
    assert (report.level, report.plan) == ("hold", "")
    assert bench.tick().refused == {why: 1}  # once for each message


def test_a_wish_that_is_played_again_is_not_believed(bench: Bench) -> None:
    bench.wish(Setpoints(20.0))
    bench.tick()
    old = bench.setpoints.latest()
    assert old is not None
    bench.wish(Setpoints(22.0))
    bench.tick()
    bench.setpoints.write(old.payload)
    report = bench.tick()
    assert report.refused == {"older than the one before": 1}
    assert report.setpoints.target_speed_mps == 22.0


def test_garbage_is_counted_and_the_last_good_wish_goes_on(bench: Bench) -> None:
    bench.wish(Setpoints(20.0))
    bench.tick()
    bench.setpoints.write(b"\x00garbage")
    report = bench.tick()
    assert (report.level, report.plan, report.refused) == ("follow", "w1", {"not JSON": 1})


def test_wishes_beyond_the_limits_are_brought_within(bench: Bench) -> None:
    bench.wish(Setpoints(90.0, 0.0))
    report = bench.tick()
    limit = bench.world.perception().speed_limit(bench.world.perception().lane_of(0))
    assert report.clipped == ("target_speed", "time_headway")
    assert report.setpoints.target_speed_mps == pytest.approx(limit + Limits().max_over_limit_mps)
    assert report.setpoints.time_headway_s == Limits().min_time_headway_s


def test_silence_leads_down_the_ladder_to_a_stand_and_a_wish_leads_back(bench: Bench) -> None:
    bench.wish(Setpoints(25.0))
    levels: list[str] = []
    for _ in range(500):
        report = bench.tick()
        if not levels or levels[-1] != report.level:
            levels.append(report.level)
        if report.speed_mps < 0.1:
            break
    assert levels == ["follow", "hold", "keep", "slow", "stop"]
    assert report.speed_mps < 0.1
    assert not bench.world.observe().ego.crashed
    bench.wish(Setpoints(25.0))
    assert bench.tick().level == "follow"


def test_a_wish_made_for_an_old_instant_is_old_however_lately_it_was_written(bench: Bench) -> None:
    for _ in range(30):
        frozen_at = 4
        bench.wish(Setpoints(25.0), tick=min(frozen_at, bench.observed().tick))
        report = bench.tick()
    assert report.age_s == pytest.approx((29 - frozen_at) * 0.1)
    assert report.level == "keep"


def test_a_plan_that_expired_is_followed_no_longer(bench: Bench) -> None:
    bench.wish(Setpoints(25.0), expires_ns=bench.now_ns)
    assert bench.tick().level == "keep"


def test_at_double_speed_ages_are_counted_in_the_time_of_the_vehicle(tmp_path: Path) -> None:
    bench = Bench(tmp_path, (OVERTAKE,), speed=2.0)
    bench.control.begin_trip()
    bench.wish(Setpoints(25.0))
    bench.tick()
    assert bench.tick().age_s == pytest.approx(0.2)


def test_asked_to_stop_it_stands_and_ends(bench: Bench) -> None:
    bench.control.stop()
    for _ in range(300):
        report = bench.tick()
        if report.ended:
            break
    assert (report.level, report.outcome) == ("stop", "stopped")
    assert report.speed_mps <= 0.1
    assert not bench.control.begin_trip()


def test_the_minimal_risk_manoeuvre_brakes_evenly_in_its_lane(bench: Bench) -> None:
    lane = bench.world.observe().ego.lane
    bench.control.stop()
    braking: list[float] = []
    for _ in range(300):
        report = bench.tick()
        braking.append(-report.applied.acceleration_mps2)
        assert report.lane == lane
        if report.ended:
            break
    assert report.outcome == "stopped"
    assert braking[2:40] == [pytest.approx(4.0)] * 38  # the lead vehicle, close as it is, draws away
    assert len(braking) * 0.1 < 10.0


@pytest.mark.parametrize("asked", [0.0, 5.0])
def test_a_policy_that_crawls_among_others_is_brought_up_to_the_least_speed(bench: Bench, asked: float) -> None:
    for _ in range(10):
        bench.wish(Setpoints(asked))
        report = bench.tick()
    assert "target_speed" in report.clipped
    assert report.setpoints.target_speed_mps is not None and report.setpoints.target_speed_mps >= 15.0


def test_an_error_in_a_period_brakes_and_control_goes_on(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise ZeroDivisionError

    speed = bench.world.observe().ego.speed_mps
    with monkeypatch.context() as broken:
        broken.setattr(type(bench.world.driver()), "command", fails)
        report = bench.tick()
    assert report.faults == 1
    assert report.applied.acceleration_mps2 == pytest.approx(-3.0)
    assert bench.world.observe().ego.speed_mps < speed
    assert bench.tick().faults == 1


def test_trips_follow_one_another_and_wishes_of_the_one_before_count_for_nothing(tmp_path: Path) -> None:
    starts = tuple(Start(find(name), 5, most_s=1.0) for name in ("overtake", "following"))
    bench = Bench(tmp_path, starts)
    ends: list[tuple[int, int]] = []
    bench.control.begin_trip()
    while not bench.control.over:
        report = bench.tick()
        if report.ended:
            ends.append((report.trip, report.tick))
            bench.wish(Setpoints(25.0))  # late, for the trip that has just ended
            bench.control.begin_trip()
    assert ends == [(1, 9), (2, 9)]
    assert report.refused == {"another trip": 1}


def test_the_loop_keeps_its_rate_and_ends_when_asked(tmp_path: Path) -> None:
    bench = Bench(tmp_path, (replace(OVERTAKE, most_s=0.5),), speed=10.0)
    bench.control.warm_up()
    ticker = Ticker(0.01)
    lateness = run(bench.control, ticker, lambda: False)
    figures = punctuality(lateness, ticker.missed)
    assert figures.ticks == 5
    assert figures.p50_ms <= figures.p99_ms <= figures.p999_ms <= figures.max_ms


def test_periods_that_cannot_be_caught_up_with_are_given_up_and_counted() -> None:
    now = 0

    def clock() -> int:
        return now

    ticker = Ticker(0.01, clock)
    now = 10_000_000
    assert ticker.wait() == 0
    now = 55_000_000  # the period due at 20 ms begins 35 ms late: those of 30, 40 and 50 ms are gone
    assert ticker.wait() == 35_000_000
    assert ticker.missed == 3
    now = 60_000_000
    assert ticker.wait() == 0
    figures = punctuality(ticker.lateness_ns, ticker.missed)
    assert (figures.ticks, figures.missed, figures.max_ms) == (3, 3, 35.0)
