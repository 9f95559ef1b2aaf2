"""The reader of answers against answers that a person has read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.bench.nuplanqa.choice import read_choice

OPTIONS = {
    "light": (
        "Red light is visible.",
        "Yellow light is visible.",
        "Green light is visible.",
        "No traffic light is visible.",
    ),
    "motion": (
        "The ego-vehicle is slowing down behind the car ahead.",
        "The ego-vehicle is keeping its speed on a free lane.",
        "The ego-vehicle is waiting at a red light.",
        "The ego-vehicle is turning left at the junction.",
    ),
    "object": ("A cyclist", "A pedestrian", "A bus", "A truck"),
    "sky": ("Clear skies with good visibility.", "Foggy, poor visibility.", "Rain at night.", "None of the above."),
    "lanes": ("One", "Two", "Three", "Four"),
    "colour": ("Red.", "Yellow.", "Green.", "There is none."),
    "vehicle": ("A car is there.", "A truck is there.", "A bus is there.", "Nobody is there."),
    "action": (
        "Stop for the traffic light.",
        "Drive on, the way is free.",
        "Overtake in the free left lane.",
        "Slow down and stay behind the vehicle.",
    ),
    "count": ("There is one lane.", "There are two lanes.", "There are three lanes.", "There are four lanes."),
}
ANSWERS, MANNERS = (
    [line.split("\t", 2) for line in (Path(__file__).parent / name).read_text(encoding="utf-8").splitlines()]
    for name in ("nuplanqa_answers.tsv", "nuplanqa_manners.tsv")
)
"""Answers as they were read by hand; and manners of answering: objects, verdicts, corrections, made-up turns."""


def test_every_hand_checked_answer_is_read_as_the_person_read_it() -> None:
    assert len(ANSWERS) >= 300
    wrong: list[str] = []
    for name, expected, answer in [*ANSWERS, *MANNERS]:
        found = read_choice(answer.replace("\\n", "\n") if "boxed" not in answer else answer, OPTIONS[name])
        letter = "-" if found.index is None else "abcd"[found.index]
        if letter != expected:
            wrong.append(f"{name}: {answer!r}: {letter} ({found.how}) instead of {expected}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    ("answer", "how"),
    [
        ("", "empty"),
        ("none of the above", "none"),
        ("I cannot determine this.", "refused"),
        ("(a) and (b)", "several"),
        ("The sky is blue.", "unclear"),
        ("the second", "ordinal"),
        ("green light is visible", "text"),
        ("(c) because", "letter"),
    ],
)
def test_why_nothing_was_chosen_is_told(answer: str, how: str) -> None:
    assert read_choice(answer, OPTIONS["light"]).how == how


VERDICTS = ("The light is red.", "A cyclist is crossing.", "The lane is clear.", "It is raining.")


@pytest.mark.parametrize(("file", "index"), [("reply.txt", 2), ("reply2.txt", 1)])
def test_recorded_verdicts_on_every_option_choose_the_right_one(
    case_folder: Callable[[str], Path], file: str, index: int
) -> None:
    answer = (case_folder("choice-per-option-verdicts") / file).read_text(encoding="utf-8")
    assert read_choice(answer, VERDICTS).index == index


PIECES = [*"aC\n{}[]✓", "(b)", " or ", "not ", "yes", "no", ": ", '"answer": ', "wait, ", "<think>", ", "]


@settings(max_examples=100)
@given(st.text(max_size=120) | st.lists(st.sampled_from(PIECES), max_size=20).map("".join))
def test_no_answer_makes_reading_fail(answer: str) -> None:
    assert read_choice(answer, OPTIONS["light"]).index in (None, 0, 1, 2, 3)
