"""What is driven of two readings: what both say; what the one that is sure says; else a question."""

from __future__ import annotations

from dataclasses import replace

import pytest

from chauffeur.concept.utterance import Utterance
from chauffeur.planners.meaning.highway import SpokenSteps
from chauffeur.planners.onboard.dialect import DialectStep, Number, StepCondition
from chauffeur.planners.onboard.two_readers import ACTS_ALONE, ACTS_SURE, SURE, alike, compared, quoted

FASTER, SLOWER = DialectStep("faster"), DialectStep("slower")
FAST = DialectStep("drive_at", Number(60.0, "mph"))


def read(
    acts: DialectStep | None, network: DialectStep | None, *, sure: float, acts_sure: float = 1.0
) -> tuple[tuple[DialectStep, ...], bool]:
    found = compared(
        Utterance("drive at 60 mph", sure=acts_sure),
        SpokenSteps(() if acts is None else (acts,)),
        () if network is None else (network,),
        sure,
    )
    return found.steps, found.sure


@pytest.mark.parametrize(
    ("acts", "network", "sure", "acts_sure", "steps", "driven"),
    [
        (FASTER, FASTER, 0.1, 0.1, (FASTER,), True),
        (FASTER, SLOWER, SURE, 1.0, (FASTER,), False),
        (FASTER, SLOWER, SURE, ACTS_ALONE - 0.1, (SLOWER,), True),
        (FASTER, SLOWER, 0.8, ACTS_ALONE, (FASTER,), True),
        (FASTER, SLOWER, 0.8, ACTS_ALONE - 0.1, (FASTER,), False),
        (FASTER, SLOWER, 0.8, ACTS_SURE - 0.1, (SLOWER,), False),
        (None, SLOWER, SURE, 1.0, (SLOWER,), True),
        (None, SLOWER, 0.8, 1.0, (SLOWER,), False),
        (FASTER, None, 1.0, 1.0, (FASTER,), True),
        (FASTER, DialectStep("drive_at", Number(80.0, "mph")), 1.0, 0.1, (FASTER,), False),
        (None, None, 1.0, 1.0, (), False),
    ],
)
def test_what_both_read_or_the_surer_one_does_is_driven(
    acts: DialectStep | None,
    network: DialectStep | None,
    sure: float,
    acts_sure: float,
    steps: tuple[DialectStep, ...],
    driven: bool,
) -> None:
    assert read(acts, network, sure=sure, acts_sure=acts_sure) == (steps, driven)


def test_a_question_of_the_acts_is_asked() -> None:
    found = compared(Utterance("more", sure=1.0), SpokenSteps(question="More of what?"), (FASTER,), 1.0)
    assert found.steps == ()


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (FASTER, DialectStep("a_bit_faster", manner="gently"), True),
        (DialectStep("lane_left"), DialectStep("lane_left_patiently"), True),
        (FASTER, SLOWER, False),
        (FASTER, DialectStep("hurry"), True),
        (FASTER, DialectStep("relax"), False),
        (FAST, DialectStep("drive_at", Number(26.8224)), True),
        (FAST, DialectStep("drive_at", Number(60.0, "kmh")), False),
        (FAST, DialectStep("at_most", Number(60.0, "mph")), False),
        (FASTER, DialectStep("faster", wait_s=Number(5.0)), False),
        (FASTER, DialectStep("faster", condition=StepCondition("if", "clear_left")), False),
        (DialectStep("overtake"), DialectStep("overtake_left"), False),
        (DialectStep("speed_times", Number(0.5)), SLOWER, False),
    ],
)
def test_alike_is_the_same_thing_to_do_with_the_same_numbers(one: DialectStep, other: DialectStep, same: bool) -> None:
    assert alike((one,), (other,)) is same
    assert alike((other,), (one,)) is same
    assert not alike((one,), (other, other))


@pytest.mark.parametrize(
    ("wish", "step", "said"),
    [
        ("slow down to 45 mph", DialectStep("drive_at", Number(45.0, "mph")), True),
        ("slow down to forty five miles an hour", DialectStep("drive_at", Number(45.0, "mph")), True),
        ("slow down to 45", DialectStep("drive_at", Number(45.0, "mph")), True),
        ("slow down to 45 mph", DialectStep("drive_at", Number(54.0, "mph")), False),
        ("slow down to 45 mph", DialectStep("drive_at", Number(45.0, "kmh")), False),
        ("stay two metres behind", DialectStep("gap_of_seconds", Number(2.0)), False),
        ("as last time, a little less", DialectStep("gap_of", Number(30.0, "", 0.85)), True),
        ("half our speed", DialectStep("speed_times", Number(0.5)), True),
    ],
)
def test_a_number_is_one_that_was_said(wish: str, step: DialectStep, said: bool) -> None:
    assert quoted(wish, (step,)) is said


def test_what_the_network_refuses_or_leaves_out_is_asked_about() -> None:
    wish = Utterance("faster, then the left lane", sure=0.7)
    both = SpokenSteps((FASTER, DialectStep("lane_left")))
    assert not compared(wish, both, (FASTER,), 1.0).sure
    assert not compared(replace(wish, sure=1.0), both, (), 0.5, refuses=True).sure
    assert compared(replace(wish, sure=1.0), both, (), 0.5).sure


def test_words_for_somebody_else_are_not_driven_by_the_network_alone() -> None:
    for address, driven in (("car", True), ("story", False)):
        assert compared(Utterance("we left", sure=0.7, address=address), SpokenSteps(), (FASTER,), 1.0).sure is driven
