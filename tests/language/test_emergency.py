"""Emergency words: a stop is read as one however it is said, and nothing else is."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.language.emergency import SAFE_STOP_WISH, read_emergency, tells_of_alarm
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


@pytest.mark.parametrize(
    "text",
    [
        "oh my god there's a child stop stop", "i can't take this anymore stop the car", "don't stop, no wait, stop!",
        "There's a child on the road!", "a kid is running into the street in front of us", "deer right ahead",
        "someone is lying on the road", "you're going to hit him", "Ｓｔｏｐ", "s\u200btop", "stoooop", "stpo",
        "break break",
        "Don't! Stop!", "we need to stop right now", "stop the car and let me out", "stop before we crash",
        "do not go any further, stop", "Stop. There is smoke.", "pedestrian crossing",
    ],
)  # fmt: skip
def test_more_stops(text: str) -> None:
    found = read_emergency(text)
    assert found is not None and found.kind == "stop"


@pytest.mark.parametrize(
    "text",
    [
        "smoke is coming from under the hood", "I smell something burning", "it smells of petrol in here",
        "We've got a flat tire",
        "I think one of the tyres just burst", "my chest hurts", "I have a pain in my chest",
        "I can't breathe properly",
        "I feel sick", "I'm feeling a bit faint", "i am going to throw up", "call an ambulance", "my wife is in labour",
        "he's having a seizure", "This is an emergency!", "Help!", "the brakes don't work", "we need to stop",
        "I don't feel well",
        "fire smell", "I think I'm having a heart attack", "stop it",
    ],
)  # fmt: skip
def test_distress_is_asked_about(text: str) -> None:
    found = read_emergency(text)
    assert found is not None and found.kind == "ask"


@pytest.mark.parametrize(
    "text",
    [
        SAFE_STOP_WISH, "Pull over when it is safe.", "please stop somewhere safe", "stop as soon as you can",
        "pull over at the nearest safe spot",
    ],
)  # fmt: skip
def test_a_safe_stop_in_so_many_words(text: str) -> None:
    found = read_emergency(text)
    assert found is not None and found.kind == "safe_stop"


@pytest.mark.parametrize(
    "text",
    [
        "", "?!", "stop sign", "bus stop", "non-stop", "drive non stop to Berlin", "he told me to stop smoking",
        "she said stop the car",
        "tell him to stop", "turn left at the stop", "turn left full stop", "when do we stop", "if you see a cop stop",
        "stop and go traffic", "stop it from drifting", "the light says stop", "I want to stop for coffee", "pull over",
        "I can't stop laughing", "don't brake so hard", "don't stop the music", "don't stop so abruptly",
        "take a break",
        "I'm sick of this traffic", "smoke that guy", "fire up the engine", "follow the fire truck",
        "I had a flat tyre yesterday",
        "I don't feel sick", "is there a child on the road", "watch for children on the road",
        "pass the cyclist in front of us",
        "the guy in front of us brakes a lot", "keep distance to the kid on the bike ahead of us",
        "I feel sick, drive more gently",
        "we need to get to the hospital", "Overtake the car in front of you.", "brake gently",
        "brake a little earlier next time",
        "he was on fire in that game", "I wish it would stop raining", "slow down a bit",
        "the car in front of us stopped",
        "stop as late as possible", "next stop is mine", "what is a good place to stop",
    ],
)  # fmt: skip
def test_everything_else_is_a_planners_business(text: str) -> None:
    assert read_emergency(text) is None


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


@pytest.mark.parametrize(
    ("thoughts", "alarm"),
    [
        ("The passenger wants me to stop the car immediately. I cannot stop on a motorway.", True),
        ("The user is asking for a sudden stop.", True),
        ("This sounds like a medical emergency; I cannot call for help.", True),
        ("They say that somebody on board is unconscious.", True),
        ("I keep out of the emergency lane.", False),
        ("This is not an emergency, and the sign says 50.", False),
        ("They want to overtake, and there is no gap.", False),
        ("They want to stop at the bakery, which I do not know.", False),
    ],
)
def test_a_models_words_tell_of_an_alarm(thoughts: str, alarm: bool) -> None:
    assert tells_of_alarm(thoughts) is alarm
