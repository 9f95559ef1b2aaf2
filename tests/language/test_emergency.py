"""Emergency words: a stop is read as one however it is said, and nothing else is."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.language.emergency import read_emergency
from chauffeur.language.plain_line import MOST_CHARACTERS

BEFORE = (
    "",
    "please ",
    "hey car, ",
    "Oh God! ",
    "no no ",
    "quick ",
    "can you ",
    "you need to ",
    "for God's sake ",
    "wait, ",
)
STOPS = (
    "stop", "stop the car", "halt", "brake", "hit the brakes", "stop this thing", "emergency stop", "come to a stop",
    "stop driving", "bring the car to a standstill", "slam on the brakes", "stop stop stop", "make the car stop",
)  # fmt: skip
AFTER = ("", " now", " please", " right now", " here", " immediately", "!", " at once, please", " I said", ". Now!")
REASONS = ("", ", there is a dog", " I feel sick", ", because the door is open", " he's going to hit us")

NEVER = (
    "don't ", "do not ", "please don't ", "you must not ", "no need to ", "never ", "I don't want you to ", "dont ",
    "whatever you do don't ", "there's no reason to ", "you don't have to ", "don't you dare ", "Keep going, don't ",
)  # fmt: skip
ACTS = (
    "stop",
    "stop the car",
    "brake",
    "pull over",
    "halt",
    "stop here",
    "come to a stop",
    "slow down",
    "pull over now",
)

OTHER_ACTS = ("tailgating him", "humming", "changing lanes", "hogging this lane", "being so nervous", "accelerating")
WHERE = (
    "at the next exit",
    "behind that truck",
    "when you see the bakery",
    "in 300 metres",
    "at the lights",
    "for fuel",
)


@given(st.sampled_from(BEFORE), st.sampled_from(STOPS), st.sampled_from(AFTER), st.sampled_from(REASONS), st.data())
def test_a_stop_is_read_however_it_is_said(
    before: str, stop: str, after: str, reason: str, data: st.DataObject
) -> None:
    text = f"{before}{stop}{after}{reason}"
    text = data.draw(st.sampled_from([text, text.upper(), text.capitalize(), f"  {text}\n"]))
    found = read_emergency(text)
    assert found is not None and found.kind == "stop", text


@given(
    st.sampled_from(NEVER), st.sampled_from(ACTS), st.sampled_from(("", "!", " please", " now", ", carry on", " here"))
)
def test_what_is_negated_is_no_stop(never: str, act: str, after: str) -> None:
    text = f"{never}{act}{after}"
    found = read_emergency(text)
    assert found is not None and found.kind == "no_stop" and found.alone, text
    assert found.slower == (act in ("brake", "slow down"))


@given(st.sampled_from(("", "please ", "could you ", "can you please ")), st.sampled_from(OTHER_ACTS))
def test_to_stop_doing_something_is_no_stop(before: str, act: str) -> None:
    assert read_emergency(f"{before}stop {act}") is None
    assert read_emergency(f"{before}don't stop {act}") is None


@given(
    st.sampled_from(("", "please ", "could you ")),
    st.sampled_from(("stop", "stop the car", "brake")),
    st.sampled_from(WHERE),
)
def test_a_stop_at_a_place_or_time_to_come_is_a_wish(before: str, stop: str, where: str) -> None:
    assert read_emergency(f"{before}{stop} {where}") is None


def test_a_stop_is_read_through_invisible_letters() -> None:
    found = read_emergency("s\u200btop")
    assert found is not None and found.kind == "stop"


def test_what_else_is_wished_goes_to_a_planner() -> None:
    found = read_emergency("Don't stop, overtake him.")
    assert found is not None and (found.kind, found.alone) == ("no_stop", False)


@given(st.text(max_size=300))
def test_no_text_raises(text: str) -> None:
    read_emergency(text)


@pytest.mark.parametrize(
    "piece",
    ["stop ", "do not ", "no , ", "not you to for ", "please ", "i feel ", "tyre is ", "child on ", "smell of ",
    "stop the ",
     "there is ", "~", "help ", "emergency . ", "the tyre is has ", "not under any circumstances , ", "a",
     "break ", "pain in "],
)  # fmt: skip
def test_no_text_is_slow(piece: str) -> None:
    """Stop is read on the session's own thread: the worst text takes what a whole one may, and not its square."""
    text = (piece * MOST_CHARACTERS)[: MOST_CHARACTERS + 1000] + "x"
    read_emergency(text)
    spent = min(_spent_s(text) for _ in range(3))
    assert spent < 0.1


def _spent_s(text: str) -> float:
    begun = time.process_time()
    read_emergency(text)
    return time.process_time() - begun


# In many manners, with what only sounds alike ------------------------------------------------------------------------

_FITS = {"stop": {"stop"}, "ask": {"stop", "safe_stop", "ask"}, "none": {"", "no_stop"}}
"""What may be read of a call to stop, of distress, and of words that are neither."""


@pytest.mark.parametrize(
    ("kind", "text"),
    [line.split("\t") for line in Path(__file__).with_name("alarms.tsv").read_text("utf-8").splitlines()],
)
def test_calls_and_distress_are_told_from_what_sounds_like_them(kind: str, text: str) -> None:
    found = read_emergency(text)
    assert ("" if found is None else found.kind) in _FITS[kind]
