"""Numbers of a program are those that were said, of the kind that was said."""

from __future__ import annotations

import pytest

from chauffeur.planners.onboard.dialect import DialectStep, Number, StepCondition
from chauffeur.planners.onboard.quoted_numbers import named, taken_over, unnamed


def speed(value: float, unit: str = "kmh") -> DialectStep:
    return DialectStep("drive_at", Number(value, unit))


def gap(value: float, unit: str = "") -> DialectStep:
    return DialectStep("gap_of", Number(value, unit))


TWO = "drive at ninety-five kilometers an hour and then keep 65 feet"


@pytest.mark.parametrize(
    ("wish", "history", "steps", "strange"),
    [
        ("drive at 95 km/h", (), [speed(95)], None),
        ("drive at 95 km/h", (), [speed(59)], Number(59, "kmh")),
        ("drive at ninety-five", (), [speed(95)], None),
        ("drive at 95", (), [speed(95, "mph")], None),
        (TWO, (), [speed(95), gap(65, "feet")], None),
        (TWO, (), [speed(65), gap(65, "feet")], Number(65, "kmh")),
        ("keep 65 feet", (), [gap(65)], Number(65)),
        ("keep 65 feet", (), [gap(19.8)], None),
        ("as last time", ("gap_of(40)",), [gap(40)], None),
        ("a bit less than last time", ("gap_of(40)",), [DialectStep("gap_of", Number(40, "", 0.85))], None),
        (
            "in 20 seconds drive at 60 mph",
            (),
            [DialectStep("drive_at", Number(60, "mph"), wait_s=Number(60))],
            Number(60),
        ),
        ("twice as fast", (), [DialectStep("speed_times", Number(7.0))], None),
    ],
)
def test_a_number_must_be_one_that_was_said_as_that_kind(
    wish: str, history: tuple[str, ...], steps: list[DialectStep], strange: Number | None
) -> None:
    assert unnamed(wish, history, steps) == strange


@pytest.mark.parametrize(
    ("wish", "steps", "right"),
    [
        (TWO, [speed(65), gap(65, "feet")], [speed(95), gap(65, "feet")]),
        ("keep sixty-five meters", [gap(65, "yards")], [gap(65)]),
        ("take it at 95 km/h", [speed(65, "")], [speed(95)]),
        ("drive at 30.3 m/s", [speed(33, "mph")], [speed(30.3, "")]),
        (
            "in 20 seconds drive at 60 mph",
            [DialectStep("drive_at", Number(60, "mph"), wait_s=Number(2))],
            [DialectStep("drive_at", Number(60, "mph"), wait_s=Number(20))],
        ),
        (
            "once the car ahead is slower than 40 mph keep 30 m",
            [DialectStep("gap_of", Number(30), condition=StepCondition("once", "lead_slower_than", Number(14, "mph")))],
            [DialectStep("gap_of", Number(30), condition=StepCondition("once", "lead_slower_than", Number(40, "mph")))],
        ),
    ],
)
def test_a_wrong_number_becomes_the_only_one_said_that_is_left(
    wish: str, steps: list[DialectStep], right: list[DialectStep]
) -> None:
    assert list(taken_over(wish, (), steps)) == right


@pytest.mark.parametrize(
    ("wish", "steps"),
    [
        ("between 50 km/h and 70 km/h", [speed(60)]),  # two were said: which one?
        ("60 km/h, then 80 km/h", [speed(90), speed(70)]),  # two are wrong
        ("go faster", [speed(60)]),  # none was said
        ("drive at 95", [speed(60)]),  # of what, nobody said
        (TWO, [speed(95), gap(65, "feet")]),  # nothing is wrong
        ("60 km/h here, 60 km/h there", [speed(90), speed(60)]),  # what was said stands there already
    ],
)
def test_where_it_is_not_plain_nothing_is_changed(wish: str, steps: list[DialectStep]) -> None:
    assert list(taken_over(wish, (), steps)) == steps


def test_a_number_may_be_taken_over_in_any_unit_in_which_it_is_round() -> None:
    assert named("keep twenty-one feet", ("gap_of(40)",)) == ("21", "40", "7")
