"""The reader of answers against answers that a person has read."""

from __future__ import annotations

from pathlib import Path

import pytest

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
ANSWERS = [
    line.split("\t", 2)
    for line in (Path(__file__).parent / "nuplanqa_answers.tsv").read_text(encoding="utf-8").splitlines()
]


def test_every_hand_checked_answer_is_read_as_the_person_read_it() -> None:
    assert len(ANSWERS) >= 300
    wrong: list[str] = []
    for name, expected, answer in ANSWERS:
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
