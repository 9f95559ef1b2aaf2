"""Turns of dialogue: what they stand for after the turn before, the closed class of short ones, and whole sentences of
acts for those that plan."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept.utterance import Act, Utterance, acts_from_json, acts_to_json
from chauffeur.language.meaning.dialogue import resolved
from chauffeur.language.meaning.reader import read
from chauffeur.language.meaning.turns import answer_in, closed_turn, takes_back
from chauffeur.language.meaning.words import wish_words


def acts(short: str) -> tuple[Act, ...]:
    """Acts of a short form: `speed value=50 unit=km/h; pick target.kind=other`; `!` before a verb negates it."""
    rows: list[dict[str, Any]] = []
    for one in filter(None, (part.strip() for part in short.split(";"))):
        verb, *fields = one.split()
        row: dict[str, Any] = {"act": verb.lstrip("!"), **({"not": True} if verb.startswith("!") else {})}
        for each in fields:
            path, value = each.split("=")
            *outer, name = path.split(".")
            held = row
            for key in outer:
                held = held.setdefault(key, {})
            held[name] = (
                float(value) if name == "value" else int(value) if name == "ordinal" else value == "yes" or value
            )
        rows.append(row)
    return acts_from_json(rows)


RESOLVED = (Path(__file__).parent / "dialogue_turns.txt").read_text().splitlines()
"""The turn before, what is said now, what it stands for."""


@pytest.mark.parametrize("row", RESOLVED, ids=lambda row: " ".join(row.split()))
def test_a_turn_means_what_it_means_after_the_one_before(row: str) -> None:
    before, now, stands_for = (acts(cell) for cell in row.split("|"))
    last = Utterance("", before) if before else None
    assert acts_to_json(resolved(Utterance("", now), last).acts) == acts_to_json(stands_for)


_VERB_ACTS = st.sampled_from([acts(cell)[0] for row in RESOLVED for cell in row.split("|") if acts(cell)])


@given(now=st.lists(_VERB_ACTS, max_size=3), before=st.none() | st.lists(_VERB_ACTS, max_size=3))
def test_nothing_elliptical_is_left_for_those_that_plan(now: list[Act], before: list[Act] | None) -> None:
    found = resolved(Utterance("", tuple(now)), None if before is None else Utterance("", tuple(before)))
    assert not {"pick", "undo"} & {act.act for act in found.acts}
    assert bool(found.acts) == bool(now)


def test_a_number_after_nothing_is_the_parser_s() -> None:
    assert [act.act for act in read("fifty").acts] != ["pick"]
    last = read("keep two car lengths of distance")
    assert [(act.act, act.value, act.unit) for act in read("three", last).acts] == [("gap", 3.0, "lengths")]


CLOSED = """
yes, please!            | yes
No.                     | no
never mind              | cancel
oh, forget it           | cancel
back as it was, please  | undo
once more               | again
a bit more              | pick direction=more degree=bit
not that much           | pick direction=less
no, the other one       | no; pick target.kind=other
no, left                | no; pick side=left
on the right please     | pick side=right
the blue one            | pick target.kind=other target.colour=blue
the second              | pick target.kind=other target.ordinal=2
fifty                   | pick value=50
make it 60 km/h         | pick value=60 unit=km/h
no, make that two car lengths | no; pick value=2 unit=lengths
drive at fifty          |
turn left               |
more distance           |
no left turns here      |
thanks                  |
go ahead                |
don't                   |
in fifty minutes        |
"""


@pytest.mark.parametrize("row", CLOSED.strip("\n").splitlines(), ids=lambda row: row.split("|")[0].strip())
def test_short_turns_are_a_closed_class(row: str) -> None:
    text, meant = row.split("|")
    assert acts_to_json(closed_turn(text.strip())) == acts_to_json(acts(meant))


@pytest.mark.parametrize(
    ("text", "answer", "back"),
    [
        ("yes", True, False), ("Yes, please.", True, False), ("That’s right!", True, False), ("go ahead", True, False),
        ("no", False, True), ("No, thanks.", False, True), ("Don't do it", False, False), ("forget that", False, True),
        ("yes but slower", None, False), ("right", None, False), ("", None, False), ("know", None, False),
        ("not now", None, False), ("slow down", None, False), ("no, yes", None, False), ("no, left", None, False),
    ],
)  # fmt: skip
def test_answers_are_whole_words_and_nothing_is_guessed(text: str, answer: bool | None, back: bool) -> None:
    assert (answer_in(text), takes_back(text)) == (answer, back)


@given(st.text(max_size=40))
def test_no_text_breaks_an_answer(text: str) -> None:
    assert answer_in(text) in (True, False, None)


@pytest.mark.parametrize(
    ("short", "words"),
    [
        ("speed value=50 unit=km/h", "Drive at 50 km/h."),
        ("speed direction=slower value=40 unit=mph", "Slow down to 40 mph."),
        ("speed direction=faster value=10 unit=mph measure=by", "Speed up by 10 mph."),
        ("speed direction=slower degree=bit", "Slow down a bit."),
        ("speed value=60 measure=at_most", "Drive at no more than 60."),
        ("speed aim=limit", "Drive at the speed limit."),
        ("go style=gentle", "Drive gently."),
        ("gap direction=more degree=bit target.kind=truck", "Keep a bit more distance to the truck."),
        ("gap value=2 unit=lengths", "Keep a gap of 2 car lengths."),
        ("lane side=left; speed direction=faster", "Change to the left lane, then speed up."),
        ("lane to=original", "Change back to the original lane."),
        (
            "pass side=left target.kind=truck target.colour=red target.ordinal=2",
            "Pass the second red truck on the left.",
        ),
        ("turn side=right when.type=once when.event=gone when.ref.kind=bus", "Turn right once the bus has gone."),
        ("turn side=right when.type=once when.event=time when.value=10 when.unit=s", "Turn right in 10 s."),
        ("!pass", "Do not pass."),
        ("cancel; speed direction=slower", "Slow down."),
        ("yes", ""),
        ("unclear", ""),
    ],
)
def test_acts_are_told_in_a_whole_sentence(short: str, words: str) -> None:
    assert wish_words(acts(short)) == words
