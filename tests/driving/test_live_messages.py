"""What control believes of what it reads: a wish that is one, and nothing else."""

from __future__ import annotations

import json
import math
from typing import Any, get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.concept import Command, Intervention, Parameters, Setpoints
from chauffeur.driving.live.messages import (
    Key,
    LiveSetpoints,
    MessageError,
    MirroredInstant,
    Report,
    Steered,
    WheelHand,
)

WISH = LiveSetpoints(
    trip=1,
    tick=7,
    plan="w1",
    issued_ns=10,
    expires_ns=20,
    state="running",
    line=3,
    setpoints=Setpoints(25.0, 1.5, "a-b:1", "left", frozenset({4, 2})),
    steered=Steered(Parameters(20.0, 8.0, 1.5, -1, "left"), "a-b:1"),
    handovers=2,
)


def fields() -> dict[str, Any]:
    return json.loads(WISH.encode())


def test_a_wish_comes_back_as_it_was() -> None:
    assert LiveSetpoints.decode(WISH.encode()) == WISH
    bare = LiveSetpoints(1, 0, "", 0, 0, "none", None, Setpoints())
    assert LiveSetpoints.decode(bare.encode()) == bare


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("speed", math.nan, "bad speed"),
        ("speed", math.inf, "bad speed"),
        ("speed", "25", "bad speed"),
        ("speed", True, "bad speed"),
        ("speed", -1.0, "speed out of range"),
        ("speed", 100.1, "speed out of range"),
        ("headway", None, "bad headway"),
        ("headway", -0.1, "headway out of range"),
        ("headway", 61, "headway out of range"),
        ("trip", -1, "bad trip"),
        ("tick", 1.0, "bad tick"),
        ("tick", True, "bad tick"),
        ("issued_ns", 1 << 63, "bad issued_ns"),
        ("expires_ns", None, "bad expires_ns"),
        ("state", "driving", "bad state"),
        ("line", "3", "bad line"),
        ("plan", None, "bad plan"),
        ("plan", "x" * 65, "bad plan"),
        ("lane", ["a", "b"], "bad lane"),
        ("lane", ["a", "b", True], "bad lane"),
        ("lane", [1, "b", 0], "bad lane"),
        ("lane", "a" * 201, "bad lane"),
        ("turn", "back", "bad turn"),
        ("turn", ["left"], "bad turn"),
        ("served", None, "bad stops"),
        ("served", ["1"], "bad stops"),
        ("served", [True], "bad stops"),
        ("served", list(range(65)), "bad stops"),
        ("handovers", -1, "bad handovers"),
        ("handovers", None, "bad handovers"),
        ("steered", [], "bad policy"),
        ("steered", "left", "bad policy"),
        ("steered", {}, "bad policy"),
    ],
)
def test_each_field_must_be_of_its_kind(name: str, value: Any, why: str) -> None:
    with pytest.raises(MessageError, match=f"^{why}$"):
        LiveSetpoints.decode(json.dumps(fields() | {name: value}).encode())


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("speed", math.nan, "bad speed"),
        ("speed", None, "bad speed"),
        ("speed", -0.1, "speed out of range"),
        ("speed", 100.1, "speed out of range"),
        ("ahead", math.inf, "bad ahead"),
        ("ahead", "12", "bad ahead"),
        ("ahead", 10_001, "ahead out of range"),
        ("ratio", -1, "ratio out of range"),
        ("ratio", 10**400, "ratio out of range"),
        ("ratio", True, "bad ratio"),
        ("lane", 2, "bad lane wish"),
        ("lane", 1.0, "bad lane wish"),
        ("lane", True, "bad lane wish"),
        ("lane", "left", "bad lane wish"),
        ("route", None, "bad route"),
        ("route", ["B4"], "bad route"),
        ("route", "x" * 65, "bad route"),
        ("origin", ["a", "b"], "bad lane"),
        ("origin", 5, "bad lane"),
    ],
)
def test_each_of_the_parameters_must_be_of_its_kind(name: str, value: Any, why: str) -> None:
    bad = fields()["steered"] | {name: value}
    with pytest.raises(MessageError, match=f"^{why}$"):
        LiveSetpoints.decode(json.dumps(fields() | {"steered": bad}).encode())


@settings(deadline=None)
@given(
    st.floats(0.0, 100.0), st.floats(0.0, 1e4), st.floats(0.0, 1e3), st.sampled_from([-1, 0, 1]), st.text(max_size=64)
)
def test_parameters_come_back_as_they_were(speed: float, ahead: float, ratio: float, lane: Any, route: str) -> None:
    steered = Steered(Parameters(speed, ahead, ratio, lane, route), None)
    assert Steered.read(json.loads(json.dumps(steered.fields()))) == steered


@pytest.mark.parametrize(
    "hand", [WheelHand(True), WheelHand(False), *(WheelHand(True, key) for key in get_args(Key))], ids=str
)
def test_what_the_hand_does_comes_back(hand: WheelHand) -> None:
    assert WheelHand.decode(hand.encode()) == hand


@pytest.mark.parametrize(
    ("payload", "why"),
    [
        (b"", "no hand"),
        (b"HAND", "no hand"),
        (b"HEAD" + bytes(9), "no hand"),
        (b"HAND\x02" + bytes(8), "no hand"),
        (b"HAND\x01" + bytes(9), "no hand"),
        (b"HAND\x01faster!!", "no key"),
        (b"HAND\x01\0faster\0", "no key"),
        (b"HAND\x01\xff\xfe" + bytes(6), "no key"),
    ],
)
def test_what_is_no_hand_is_refused(payload: bytes, why: str) -> None:
    with pytest.raises(MessageError, match=f"^{why}$"):
        WheelHand.decode(payload)


@pytest.mark.parametrize("name", sorted(set(fields()) - {"speed", "lane", "turn", "line", "steered"}))
def test_a_missing_field_is_none(name: str) -> None:
    short = {key: value for key, value in fields().items() if key != name}
    with pytest.raises(MessageError):
        LiveSetpoints.decode(json.dumps(short).encode())


@pytest.mark.parametrize("name", sorted(set(fields()["steered"]) - {"origin", "pose"}))
def test_none_of_the_parameters_may_be_missing(name: str) -> None:
    short = {key: value for key, value in fields()["steered"].items() if key != name}
    with pytest.raises(MessageError):
        Steered.read(short)


@settings(deadline=None)
@given(st.binary(max_size=400))
def test_no_bytes_do_more_than_be_refused(payload: bytes) -> None:
    for kind in (LiveSetpoints, MirroredInstant, WheelHand):
        try:
            kind.decode(payload)
        except MessageError:
            continue


@pytest.mark.parametrize("payload", [b"", b"[]", b"null", b"{", b"\xff\xfe", b"[" * 5000, b'"' + b"x" * 100 + b'"'])
def test_what_is_no_object_is_no_wish(payload: bytes) -> None:
    with pytest.raises(MessageError, match=r"^(not JSON|no object)$"):
        LiveSetpoints.decode(payload)


def test_an_observation_comes_back_and_a_short_one_is_none() -> None:
    shown = MirroredInstant(3, 99, b"world", 5)
    assert MirroredInstant.decode(shown.encode()) == shown
    with pytest.raises(MessageError, match="too short"):
        MirroredInstant.decode(b"0123456789")


def test_a_report_comes_back_as_it_was() -> None:
    before, after = Command(1.0, 0.1), Command(-2.0, 0.0)
    report = Report(
        trip=1, tick=2, late_ns=3, level="hold", plan="w1", state="running", line=None, age_s=0.5,
        setpoints=WISH.setpoints, requested=before, applied=after,
        interventions=(Intervention("gap", "Too close.", before, after),), clipped=("target_speed",),
        refused={"not JSON": 2}, missed=1, faults=0, speed_mps=20.0, lane="a-b:0", taken_over=True,
        said=("Changing to the left lane.",),
    )  # fmt: skip
    assert Report.decode(report.encode()) == report
