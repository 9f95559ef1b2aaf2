"""What may be published to a vehicle at all: numbers, the vehicle's file, and lines for people."""

from __future__ import annotations

import datetime
import math
import shlex
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept import ConfigError, MissingExtraError, Parameters
from chauffeur.worlds.ros import VehicleError, VehicleInterface, VehicleLimits, VehicleRefusalError
from chauffeur.worlds.ros.autoware import Autoware
from chauffeur.worlds.ros.autoware_ai import Acknowledgement, AutowareAi, ConstantSpeed, PlannedSpeed, Replanner
from chauffeur.worlds.ros.dry import DryRun
from chauffeur.worlds.ros.factory import open_vehicle
from chauffeur.worlds.ros.limits import checked
from chauffeur.worlds.ros.settings import SENTENCE, parse_settings, read_settings

LIMITS = VehicleLimits(12.0, (4.0, 20.0), (0.5, 4.0))
REPLANNER = Replanner(planned_max_mps=12.0)
GOOD = Parameters(10.0, 8.0, 2.0)
TODAY = datetime.date(2026, 6, 1)
ANYTHING = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True),
    st.integers(-(10**400), 10**400),
    st.booleans(),
    st.none(),
    st.text(max_size=5),
)


@given(ANYTHING, ANYTHING, ANYTHING, st.one_of(st.integers(-3, 3), st.booleans(), st.floats(), st.text(max_size=3)))
def test_what_passes_is_finite_and_within_the_vehicles_limits(speed: Any, ahead: Any, ratio: Any, lane: Any) -> None:
    try:
        wish = checked(Parameters(speed, ahead, ratio, lane), LIMITS)
    except VehicleRefusalError as error:
        assert error.hint
        assert len(str(error)) < 300
        return
    for value in (wish.speed_mps, wish.look_ahead_m, wish.look_ahead_ratio_s):
        assert type(value) is float
        assert math.isfinite(value)
    assert 0.0 <= wish.speed_mps <= 12.0
    assert 4.0 <= wish.look_ahead_m <= 20.0
    assert 0.5 <= wish.look_ahead_ratio_s <= 4.0
    assert wish.lane in (-1, 0, 1)
    assert type(wish.lane) is int


@pytest.mark.parametrize("lane", [True, 2, -2, 1.0, "1", None])
def test_a_lane_wish_is_one_of_three(lane: Any) -> None:
    with pytest.raises(VehicleRefusalError, match="lane wish"):
        checked(Parameters(10.0, 8.0, 2.0, lane), LIMITS)


@pytest.mark.parametrize("kmh", [5, 10, 20, 30, 43])
def test_a_whole_speed_is_published_whole_though_planners_store_hundredths_of_mps(kmh: int) -> None:
    speed = math.ceil(kmh / 3.6 * 100.0) / 100.0
    cap = DryRun(AutowareAi(LIMITS, REPLANNER)).apply(Parameters(speed, 8.0, 2.0)).messages[0].fields
    assert cap["velocity_max"] == kmh


@given(st.floats(0.0, 12.0), st.floats(4.0, 20.0), st.floats(0.5, 4.0))
def test_what_is_within_the_limits_passes_and_no_speed_is_raised(speed: float, ahead: float, ratio: float) -> None:
    car = DryRun(AutowareAi(LIMITS, REPLANNER))
    cap, follower = (message.fields for message in car.apply(Parameters(speed, ahead, ratio)).messages)
    assert speed * 3.6 - 0.1 - 6e-4 <= cap["velocity_max"] <= speed * 3.6 + 6e-4, "tenths of km/h, rounded down"
    assert cap["velocity_min"] <= cap["velocity_max"]  # above it, the replanner would raise speeds past the cap
    assert cap["replanning_mode"]
    assert cap["realtime_tuning_mode"]  # without it the cap waits for the next route
    assert not cap["overwrite_vmax_mode"]
    assert min(cap["accel_limit"], cap["decel_limit"]) > 0
    assert follower["param_flag"] == 0
    assert follower["minimum_lookahead_distance"] == follower["lookahead_distance"] == ahead > 0
    assert follower["lookahead_ratio"] == ratio


def replanned(planned: list[float], settings: dict[str, Any]) -> list[float]:
    """What Autoware.AI's `waypoint_replanner` makes of planned speeds on a straight lane with a waypoint every metre:
    a model of it, from its source. Speeds in m/s."""
    most, least = settings["velocity_max"] / 3.6, settings["velocity_min"] / 3.6
    speeds, last = list(planned), len(planned) - 1

    def limit(start: int, end: int, speed: float) -> None:
        for index in range(start, end + 1):
            speeds[index] = min(speeds[index], speed)
        for at in (start, end):  # slopes outwards from both ends
            for step, slope in ((1, settings["accel_limit"]), (-1, settings["decel_limit"])):
                speed, index = speeds[at], at + step
                while 0 <= index <= last:
                    speed = math.sqrt(2 * slope + speed * speed)
                    if speed > most or speed > speeds[index]:
                        break
                    speeds[index], index = speed, index + step

    if not settings["replanning_mode"]:
        return speeds
    limit(0, last, most)
    if settings["replan_curve_mode"] and settings["overwrite_vmax_mode"]:
        speeds[:] = [most] * len(speeds)
    if settings["replan_endpoint_mode"]:
        stop = last - settings["end_point_offset"]
        speeds[:] = [max(speed, least) for speed in speeds]
        limit(0, 0, least)
        limit(stop - settings["braking_distance"], last, least)
        speeds[stop:] = [0.0] * len(speeds[stop:])
    return speeds


@given(st.lists(st.one_of(st.just(0.0), st.floats(0.0, 20.0)), min_size=12, max_size=40), st.floats(0.0, 12.0))
def test_a_cap_only_ever_lowers_what_was_planned(planned: list[float], cap_mps: float) -> None:
    car = DryRun(AutowareAi(LIMITS, REPLANNER))
    capped = replanned(planned, car.apply(Parameters(cap_mps, 8.0, 2.0)).messages[0].fields)
    assert all(new <= min(old, cap_mps) + 1e-3 for new, old in zip(capped, planned, strict=True))
    lifted = replanned(planned, car.release().messages[0].fields)
    assert all(new <= old + 1e-3 for new, old in zip(lifted, planned, strict=True))
    stopping = AutowareAi(LIMITS, Replanner(planned_max_mps=12.0, stop_at_end=True, curve_speed_mps=3.0))
    ending = replanned(planned, DryRun(stopping).apply(Parameters(cap_mps, 8.0, 2.0)).messages[0].fields)
    assert max(ending) <= cap_mps + 1e-3  # the end's slow speed, which is a least speed too, never lifts past the cap


def test_the_model_of_the_replanner_shows_what_goes_wrong_otherwise() -> None:
    settings = dict(DryRun(AutowareAi(LIMITS, REPLANNER)).apply(Parameters(2.0, 8.0, 2.0)).messages[0].fields)
    planned = [8.0] * 10 + [0.0] + [8.0] * 10
    assert replanned(planned, settings)[10] == 0.0
    assert max(replanned(planned, settings | {"overwrite_vmax_mode": True})) == pytest.approx(2.0)
    assert replanned(planned, settings | {"overwrite_vmax_mode": True})[10] == pytest.approx(2.0)  # through the stop
    ends = {"replan_endpoint_mode": True, "velocity_min": 18.0}
    assert max(replanned(planned, settings | ends)) == pytest.approx(5.0)  # past the cap
    assert replanned([0.0, *planned], settings | {"accel_limit": 0.0}) == [0.0] * 22  # never drives off again


@pytest.mark.parametrize("bad", [Parameters(12.1, 8.0, 2.0), Parameters(-0.1, 8.0, 2.0), Parameters(10.0, 0.0, 2.0)])
def test_a_refused_wish_leaves_nothing_behind(bad: Parameters) -> None:
    car = DryRun(AutowareAi(LIMITS, REPLANNER))
    with pytest.raises(VehicleRefusalError, match="not published"):
        car.apply(bad)
    assert car.lines == ()
    assert dict(car.state().counts)["published"] == 0


def test_a_lane_change_is_refused_whole() -> None:
    car = DryRun(AutowareAi(LIMITS, REPLANNER))
    with pytest.raises(VehicleRefusalError, match="lane change"):
        car.apply(Parameters(10.0, 8.0, 2.0, lane=-1))
    assert car.lines == ()


def test_the_unsafe_source_of_speed_needs_a_person_and_ends_with_us() -> None:
    safe = DryRun(AutowareAi(LIMITS, REPLANNER, PlannedSpeed()))
    assert "capped at 36 km/h" in safe.apply(GOOD).words
    answered = ConstantSpeed(Acknowledgement("Ana Example", 5.0))
    car = DryRun(AutowareAi(LIMITS, REPLANNER, answered))
    with pytest.raises(VehicleRefusalError, match="Ana Example answers for"):
        car.apply(GOOD)
    published = car.apply(Parameters(5.0, 8.0, 2.0))
    assert "IGNORED" in published.words
    assert published.messages[1].fields["param_flag"] == 1
    car.close()
    assert "param_flag: 0" in car.lines[-1]
    safe.close()
    assert len(safe.lines) == 2  # a cap stays in force: a program that ends is no reason to drive faster


def test_lines_are_what_would_be_published() -> None:
    car = DryRun(AutowareAi(LIMITS, REPLANNER))
    car.apply(GOOD)
    assert car.lines[1] == (
        "rostopic pub -1 /config/waypoint_follower autoware_config_msgs/ConfigWaypointFollower "
        "'{header: auto, param_flag: 0, velocity: 36.0, lookahead_distance: 8.0, lookahead_ratio: 2.0, "
        "minimum_lookahead_distance: 8.0, displacement_threshold: 0.0, relative_angle_threshold: 0.0}'"
    )
    words = shlex.split(car.lines[0])
    assert words[:5] == ["rostopic", "pub", "-1", "/config/waypoint_replanner", words[4]]
    assert words[5].startswith(
        '{multi_lane_csv: "", replanning_mode: true, use_decision_maker: false, velocity_max: 36.0'
    )


def test_release_gives_the_cap_back_and_a_closed_interface_says_so() -> None:
    car: VehicleInterface = DryRun(AutowareAi(LIMITS, REPLANNER))
    assert len(car.release().messages) == 1  # no look-ahead was wished yet
    car.apply(Parameters(3.0, 8.0, 2.0))
    cap, follower = car.release().messages
    assert cap.fields["velocity_max"] == pytest.approx(43.2)
    assert follower.fields["lookahead_distance"] == 8.0
    car.close()
    car.close()
    assert car.state().link == "closed"
    with pytest.raises(VehicleError, match="closed"):
        car.apply(GOOD)


FILE = """
interface = "rosbridge"
stack = "autoware.ai"

[limits]
max_speed_mps = 8.0
look_ahead_m = [4.0, 20.0]

[rosbridge]
url = "ws://127.0.0.1:9091"
"""
CONSTANT = f"""
[constant_speed]
acknowledged_by = "Ana Example"
acknowledgement = "{SENTENCE}"
until = 2026-06-20
max_speed_mps = 3.0
"""


def test_a_vehicles_file(tmp_path: Path) -> None:
    path = tmp_path / "vehicle.toml"
    path.write_text(FILE, encoding="utf-8")
    settings = read_settings(path)
    assert isinstance(settings.stack, AutowareAi)
    assert settings.stack.limits == VehicleLimits(8.0, (4.0, 20.0))
    assert settings.stack.replanner.planned_max_mps == 8.0
    assert settings.stack.source == PlannedSpeed()
    assert settings.rosbridge.url == "ws://127.0.0.1:9091"
    assert isinstance(open_vehicle(settings, dry_run=True), DryRun)
    with pytest.raises(ConfigError, match="cannot be read"):
        read_settings(tmp_path / "none.toml")


def test_an_acknowledgement_is_word_for_word_and_ends() -> None:
    stack = parse_settings(FILE + CONSTANT, today=TODAY).stack
    assert isinstance(stack, AutowareAi)
    assert stack.source == ConstantSpeed(Acknowledgement("Ana Example", 3.0))
    for changed, words in (
        (CONSTANT.replace("only the driver", "the driver"), "word for word"),
        (CONSTANT.replace("2026-06-20", "2026-05-31"), "ended on 2026-05-31"),
        (CONSTANT.replace("2026-06-20", "2026-12-31"), "lasts 213 days"),
        (CONSTANT.replace("until = 2026-06-20\n", ""), "until"),
        (CONSTANT.replace('acknowledged_by = "Ana Example"', ""), "acknowledged_by"),
    ):
        with pytest.raises(ConfigError, match=words):
            parse_settings(FILE + changed, today=TODAY)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("max_speed_mps = 8.0", "max_speed_mps = nan", "max_speed_mps"),
        ("max_speed_mps = 8.0", "max_speed_mps = 80", "max_speed_mps"),
        ("max_speed_mps = 8.0", "", "max_speed_mps"),
        ("[4.0, 20.0]", "[0.0, 20.0]", "look_ahead_m"),
        ("[4.0, 20.0]", "[20.0, 4.0]", "smaller comes first"),
        ("[rosbridge]", "[rosbridge]\nparam_flag = 1", "param_flag"),
        ("[limits]", "[limits", "no TOML"),
        ('"rosbridge"', '"shell"', "interface"),
    ],
)
def test_a_file_that_is_wrong_is_refused_with_the_place(old: str, new: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        parse_settings(FILE.replace(old, new, 1))


@pytest.mark.parametrize(
    ("text", "kind", "line"),
    [
        ('interface = "ros2"', Autoware, "ros2 topic pub --once --qos-reliability reliable --qos-durability"),
        ('interface = "rosbridge"\nstack = "autoware"', Autoware, "ros2 topic pub"),
        ('interface = "rosbridge"\nstack = "autoware.ai"', AutowareAi, "rostopic pub -1 "),
        ('interface = "dry-run"', AutowareAi, "rostopic pub -1 "),
        (
            'interface = "dry-run"\nstack = "autoware"\nmessages = "tier4_planning_msgs"',
            Autoware,
            "tier4_planning_msgs/msg/",
        ),
    ],
)
def test_every_way_to_a_vehicle_has_a_dry_run(text: str, kind: type, line: str) -> None:
    settings = parse_settings(f"{text}\n[limits]\nmax_speed_mps = 8.0\n")
    assert isinstance(settings.stack, kind)
    car = open_vehicle(settings, dry_run=True)
    assert isinstance(car, DryRun)
    car.apply(Parameters(4.0, 8.0, 2.0))
    car.release()
    assert len(car.lines) == 4
    assert all(line in one for one in car.lines)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('interface = "rosbridge"', "stack ="),
        ('interface = "ros2"\nstack = "autoware.ai"', "over ros2 the stack is autoware"),
        ('interface = "ros1"', 'write interface = "rosbridge"'),
        (
            'interface = "rosbridge"\nstack = "autoware.ai"\n[ros1]\nmaster = "http://127.0.0.1:11311"',
            r"take \[ros1\] out",
        ),
        ('interface = "ros2"\n[ros2]\nhost = "example.org"', "IPv4"),
        ('interface = "ros2"\n[constant_speed]', "constant_speed"),
        ('interface = "ros2"\n[replanner]', r"\[replanner\]"),
        ('interface = "ros2"\n[ros2]\ndomain = 233', "domain"),
        ('interface = "ros2"\n[ros2]\nhost = "0.0.0.0"', "every address"),
        ('interface = "ros2"\n[ros2]\npeers = ["192.168.1.5"]', "cannot reach"),
        ('interface = "ros2"\n[ros2]\npeers = ["127.0.0.1\\"/><x>"]', "no IPv4 address"),
    ],
)
def test_ways_that_do_not_fit_are_refused(text: str, words: str) -> None:
    first, *rest = text.split("\n[", 1)
    tables = "".join(f"[{table}\n" for table in rest)
    with pytest.raises(ConfigError, match=words):
        parse_settings(f"{first}\n[limits]\nmax_speed_mps = 8.0\n{tables}")


@pytest.mark.parametrize(
    ("library", "text"),
    [
        ("cyclonedds", 'interface = "ros2"'),
        ("websockets", 'interface = "rosbridge"\nstack = "autoware.ai"'),
    ],
)
def test_a_missing_library_is_named_with_what_installs_it(
    library: str, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [library, *(one for one in sys.modules if one.startswith(f"{library}."))]:
        monkeypatch.setitem(sys.modules, name, None)
    settings = parse_settings(f"{text}\n[limits]\nmax_speed_mps = 8.0\n")
    with pytest.raises(MissingExtraError, match=r"-m pip install .*\[ros\]") as caught:
        open_vehicle(settings)
    assert library in caught.value.message
