"""What wishes mean: a table of phrasings of our own, and properties that no phrasing may break."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept.units import MPS_PER_KMH, MPS_PER_MPH
from chauffeur.planners.onboard.meaning import Meaning, NotUnderstood, Reading
from chauffeur.planners.onboard.understand import understand

MEANT: dict[str, str] = {
    # faster and slower
    "Drive as fast as you can.": "speed.max",
    "Can you drive faster?": "speed.increase",
    "You should drive slower.": "speed.decrease",
    "You are driving a little bit slow now.": "speed.increase",
    "I do not think we should drive this slow.": "speed.increase",
    "I don't think we should be going this fast.": "speed.decrease",
    "slow down a touch": "speed.decrease",
    "Not so fast!": "speed.decrease",
    "not so slow please": "speed.increase",
    "You're driving too fast": "speed.decrease",
    "we are going way too slow": "speed.increase",
    "why are we going so slowly": "speed.increase",
    "Why are you driving so fast?": "speed.decrease",
    "do we have to drive this slow?": "speed.increase",
    "that's not fast enough": "speed.increase",
    "don't drive so fast": "speed.decrease",
    "Please don't go that slow": "speed.increase",
    "stop speeding": "speed.decrease",
    "quit crawling along": "speed.increase",
    "step on it": "speed.increase",
    "pick up the pace, would you": "speed.increase",
    "ease off the gas": "speed.decrease",
    "brake a little": "speed.decrease",
    "could we maybe go a bit quicker": "speed.increase",
    "lower your speed a bit": "speed.decrease",
    "a bit more speed please": "speed.increase",
    "reduce the speed": "speed.decrease",
    "bring the speed up": "speed.increase",
    "take it down a notch": "speed.decrease",
    "I'd like to go faster": "speed.increase",
    "I want you to accelerate": "speed.increase",
    "would you mind slowing down": "speed.decrease",
    "would you mind not driving so fast": "speed.decrease",
    "why don't you speed up": "speed.increase",
    "Don't you think we could go faster?": "speed.increase",
    "can't you go any faster": "speed.increase",
    "don't be afraid to speed up": "speed.increase",
    "The speed is too high": "speed.decrease",
    "our speed is too low": "speed.increase",
    "I can't stand going this slow": "speed.increase",
    "cut your speed in half": "speed.decrease x0.5",
    "speed up, don't slow down": "speed.increase",
    "don't speed up, slow down": "speed.decrease",
    "go faster but not too fast": "speed.increase",
    "no, slower": "speed.decrease",
    "Don't speed up": "speed.hold",
    "do not accelerate": "speed.hold",
    "don't slow down": "speed.hold",
    "please don't brake": "speed.hold",
    "you don't need to speed up": "speed.hold",
    "keep this speed": "speed.hold",
    "maintain your current speed": "speed.hold",
    "that's fast enough": "speed.hold",
    "match traffic": "speed.match",
    "go with the flow": "speed.match",
    "keep up with traffic": "speed.match",
    "match the speed of the car ahead": "speed.match",
    "drive at the speed limit": "speed.limit",
    "go as fast as is legal": "speed.limit",
    "stick to the limit": "speed.limit",
    "floor it": "speed.max",
    # speeds with numbers
    "do 65 mph": "speed.set 29.06 m/s",
    "go 100 km/h": "speed.set 27.78 m/s",
    "drive at twenty-five meters per second": "speed.set 25.00 m/s",
    "slow down to 40 miles per hour": "speed.set 17.88 m/s",
    "speed up by 5 mph": "speed.increase 2.24 m/s",
    "go ten miles an hour faster": "speed.increase 4.47 m/s",
    "5 km/h slower please": "speed.decrease 1.39 m/s",
    "drop down to 80 kph": "speed.set 22.22 m/s",
    "take 10 km/h off": "speed.decrease 2.78 m/s",
    "at 28 m/s": "speed.set 28.00 m/s",
    "65mph please": "speed.set 29.06 m/s",
    "cruise at a hundred and ten km/h": "speed.set 30.56 m/s",
    "go from 20 to 25 m/s": "speed.set 25.00 m/s",
    "never go faster than 60 mph": "speed.cap 26.82 m/s",
    "don't exceed 100 km/h": "speed.cap 27.78 m/s",
    "no faster than 25 m/s": "speed.cap 25.00 m/s",
    "stay below 90 km/h": "speed.cap 25.00 m/s",
    "drive at least 20 m/s": "speed.floor 20.00 m/s",
    "don't go below 50 mph": "speed.floor 22.35 m/s",
    "reduce speed by 20 percent": "speed.decrease x0.8",
    "go 10 mph over the limit": "speed.limit 4.47 m/s",
    "go 65": "speed.set 65 bare",
    "set the cruise control to 70": "speed.set 70 bare",
    # gaps
    "could you give the truck ahead a bit more room": "gap.increase",
    "you're glued to that bumper": "gap.increase",
    "stop following so closely": "gap.increase",
    "Don't follow so close": "gap.increase",
    "you're tailgating him": "gap.increase",
    "back off": "gap.increase",
    "hang back a little": "gap.increase",
    "leave more space to the car in front": "gap.increase",
    "We are too close to that van": "gap.increase",
    "the gap is too small": "gap.increase",
    "there isn't enough room between us and the bus": "gap.increase",
    "not so close!": "gap.increase",
    "drop back": "gap.increase",
    "keep your distance": "gap.increase",
    "I'd feel better further away from that truck": "gap.increase",
    "widen the gap": "gap.increase",
    "more distance please": "gap.increase",
    "get closer to the car in front": "gap.decrease",
    "close the gap": "gap.decrease",
    "You are too far behind": "gap.decrease",
    "not so far behind": "gap.decrease",
    "catch up with that car": "gap.decrease",
    "the gap is too big": "gap.decrease",
    "tighten up the distance": "gap.decrease",
    "follow closer": "gap.decrease",
    "less space to the lead car please": "gap.decrease",
    "Don't get any closer": "gap.hold",
    "don't back off": "gap.hold",
    "keep this distance": "gap.hold",
    "maintain the current following distance": "gap.hold",
    "keep two seconds behind": "gap.time 2.00 s",
    "follow at 30 metres": "gap.set 30.00 m",
    "stay forty meters behind the truck": "gap.set 40.00 m",
    "keep 3 car lengths behind him": "gap.set 15.00 m",
    "100 feet behind the car ahead": "gap.set 30.48 m",
    "get within 20 meters of the lead car": "gap.cap 20.00 m",
    "15 meters closer": "gap.decrease 15.00 m",
    "ten more meters of distance": "gap.increase 10.00 m",
    "drop back another 10 m": "gap.increase 10.00 m",
    "close up by 5 meters": "gap.decrease 5.00 m",
    "double the gap": "gap.increase x2",
    "halve the following distance": "gap.decrease x0.5",
    "at least 25 meters distance": "gap.floor 25.00 m",
    "no closer than 30 meters": "gap.floor 30.00 m",
    "give me a three second gap": "gap.time 3.00 s",
    "let him in": "yield",
    "let that car merge": "yield",
    "let them pass": "yield",
    # lanes
    "change to the left lane": "lane.left",
    "Change to the right lane": "lane.right",
    "could you hop over into the lane on the left": "lane.left",
    "scoot over to the right": "lane.right",
    "move over one lane to the left": "lane.left",
    "take the right-hand lane when it is safe": "lane.right",
    "get in the fast lane": "lane.left edge",
    "go all the way to the right": "lane.right edge",
    "change lanes": "lane",
    "Do not change lanes": "lane.keep",
    "stay in this lane": "lane.keep",
    "don't move to the left lane": "lane.keep",
    "don't leave your lane": "lane.keep",
    "left lane now please": "lane.left",
    "right now, move left": "lane.left",
    # overtaking
    "get us past this slowpoke": "overtake",
    "overtake that lorry on the left": "overtake.left",
    "pass him on the right": "overtake.right",
    "go around the car in front": "overtake",
    "This truck is too slow, get past it": "overtake",
    "use the left lane to pass": "overtake.left",
    "I'm tired of being stuck behind this van": "overtake",
    "that car is crawling": "overtake",
    "Don't overtake": "follow",
    "stay behind the truck": "follow",
    "follow that car": "follow",
    # pulling over and stopping
    "drop me on the shoulder": "pull_over",
    "pull over": "pull_over",
    "please stop on the side of the road": "pull_over",
    "let me out here": "pull_over",
    "park on the hard shoulder": "pull_over",
    "Don't pull over": "resume",
    "stop the car": "stop",
    "come to a halt": "stop",
    "don't stop": "resume",
    # turns
    "hang a left at the lights": "turn.left",
    "take a right at the next junction": "turn.right",
    "at the crossing go left": "turn.left",
    "go straight on": "turn.straight",
    "turn right here": "turn.right",
    "turn left, not right": "turn.left",
    "not left, turn right": "turn.right",
    "don't turn, keep going straight": "turn.straight",
    "do not take any turns": "turn.straight",
    "drive straight through the intersection": "turn.straight",
    "cross the intersection": "turn.straight",
    "stop at the stop sign and then turn left": "turn.left",
    "slow down and turn right at the corner": "turn.right",
    # ways of driving
    "I'm really in a hurry now": "style.hurry",
    "I am late for my flight": "style.hurry",
    "I am going to be late for my work.": "style.hurry",
    "I can't be late": "style.hurry",
    "no need to rush": "style.relax",
    "I'm not in a hurry": "style.relax",
    "we're not late": "style.relax",
    "take your time": "style.relax",
    "we have plenty of time": "style.relax",
    "my stomach is not feeling well": "style.comfort",
    "I feel a bit motion-sick right now.": "style.comfort",
    "the baby is asleep": "style.comfort",
    "drive more smoothly": "style.comfort",
    "You are driving too conservatively.": "style.sporty",
    "don't be so timid": "style.sporty",
    "drive carefully": "style.careful",
    "you drive like a maniac": "style.careful",
    "I'm scared": "style.careful",
    "you're being too aggressive": "style.careful",
    "don't drive so aggressively": "style.careful",
    "sport mode": "style.sporty",
    "save some battery": "style.eco",
    # leaving things
    "carry on": "resume",
    "never mind": "resume",
    "this is perfect": "keep",
    # several things
    "overtake it, then pull over": "overtake; pull_over",
    "overtake on the left and then go back to the right lane": "overtake.left; lane.right",
    "change to the left lane and speed up": "lane.left; speed.increase",
    "after you pass the truck, move to the right lane": "overtake; lane.right",
    "slow down and let him in": "yield",
    "I'm late, overtake him": "overtake",
    "slow down and leave more room": "gap.increase",
    "don't change lanes, just slow down": "speed.decrease",
    "go to 25 m/s, then keep 30 meters behind": "speed.set 25.00 m/s; gap.set 30.00 m",
}  # fmt: skip

DECLINED: dict[str, str] = {
    "": "empty",
    "   ": "empty",
    "🚗💨": "symbols",
    "?!?": "symbols",
    "Fahr bitte schneller": "language",
    "plus vite s'il vous plaît": "language",
    "¡más rápido, por favor!": "language",
    "请开快一点": "language",
    "play some jazz": "off_topic",
    "play some faster jazz": "off_topic",
    "turn up the volume": "off_topic",
    "turn on the air conditioning": "off_topic",
    "tell me a joke": "off_topic",
    "call my mother": "off_topic",
    "take me to the airport": "unsupported",
    "make a U-turn": "unsupported",
    "drive in reverse": "unsupported",
    "honk at him": "unsupported",
    "run the red light": "unsupported",
    "the car behind us is too close": "unsupported",
    "how fast are we going?": "question",
    "what is the speed limit here": "question",
    "are we driving too fast?": "question",
    "faster and slower": "ambiguous",
    "increase it": "ambiguous",
    "about that distance": "ambiguous",
    "20": "ambiguous",
    "don't turn left": "ambiguous",
    "go left or right": "ambiguous",
    "lorem ipsum dolor sit amet": "unknown",
    "is that right?": "question",
    "It is breakfast time": "off_topic",
    "go " * 600: "too_long",
}


def brief(result: Reading | NotUnderstood) -> str:
    if isinstance(result, NotUnderstood):
        return f"<{result.why}>"
    return "; ".join(_step(step) for step in result.steps)


def _step(step: Meaning) -> str:
    text = step.family
    if step.amount is not None and step.amount.dimension != "lanes":
        units = {"speed": " m/s", "distance": " m", "time": " s"}
        if step.amount.dimension in units:
            text += f" {step.amount.value:.2f}{units[step.amount.dimension]}"
        elif step.amount.dimension == "share":
            text += f" x{step.amount.value:g}"
        else:
            text += f" {step.amount.value:g} {step.amount.dimension}"
    if step.variant == "edge":
        text += " edge"
    return text


def test_meaning() -> None:
    read = {wish: brief(understand(wish)) for wish in MEANT}
    assert {wish: words for wish, words in read.items() if words != MEANT[wish]} == {}


@pytest.mark.parametrize("why", sorted(set(DECLINED.values())))
def test_declined_in_words(why: str) -> None:
    for wish in (wish for wish, meant in DECLINED.items() if meant == why):
        result = understand(wish)
        assert isinstance(result, NotUnderstood), wish
        assert result.why == why, wish
        assert len(result.words) > 20, wish


DRESSES = ("{}", "{}!!", "Hey, {}", "please {}", "{} thanks", "  {}  ", "OK {}, please")


def test_politeness_punctuation_and_case_change_nothing() -> None:
    """Each wish in two dresses, so that each dress is worn by dozens of wishes."""
    dressed = [
        (wish, DRESSES[(number + shift) % len(DRESSES)].format(wish.rstrip(" .!?")))
        for number, wish in enumerate(MEANT)
        for shift in (0, 3)
    ]
    dressed += [(wish, wish.upper()) for wish in list(MEANT)[::2]]
    assert {text: read for wish, text in dressed if (read := brief(understand(text))) != MEANT[wish]} == {}


def mirrored(text: str) -> str:
    """Left and right swapped."""
    return re.sub(r"\b(left|right)\b", lambda m: "right" if m[0].lower() == "left" else "left", text, flags=re.I)


_SIDED = [wish for wish in MEANT if re.search(r"\b(left|right)\b", wish, re.I) and "right now" not in wish.lower()]


@given(wish=st.sampled_from(_SIDED), tail=st.sampled_from(["", " please", " now", " if you can", ", thanks"]))
def test_mirrored_wish_means_the_mirrored_manoeuvre(wish: str, tail: str) -> None:
    assert brief(understand(mirrored(wish) + tail)) == mirrored(brief(understand(wish + tail)))


_UP = ["speed up", "go faster", "drive faster", "accelerate", "increase your speed", "pick up the pace"]
_DOWN = ["slow down", "go slower", "drive slower", "decelerate", "reduce your speed", "ease off the gas"]
_FRAMES = ["{}", "please {}", "could you {}", "I want you to {}", "I think you should {} a bit", "{} a lot",
           "I'd really like you to {} now", "hey, would you mind, {}", "{} when it is safe"]  # fmt: skip


@given(k=st.integers(0, 5), frame=st.sampled_from(_FRAMES))
def test_faster_and_slower_never_flip(k: int, frame: str) -> None:
    up, down = understand(frame.format(_UP[k])), understand(frame.format(_DOWN[k]))
    assert brief(up) == "speed.increase"
    assert brief(down) == "speed.decrease"


@given(
    k=st.integers(0, 3),
    negation=st.sampled_from(["don't {}", "do not {}", "never {}", "you don't have to {}", "I don't want you to {}"]),
)
def test_a_negated_change_is_no_change(k: int, negation: str) -> None:
    for words in (_UP[k], _DOWN[k]):
        assert brief(understand(negation.format(words))) == "speed.hold"


@given(value=st.integers(1, 250))
def test_units_agree(value: int) -> None:
    def speed(text: str) -> float:
        result = understand(text)
        assert isinstance(result, Reading)
        amount = result.steps[0].amount
        assert amount is not None
        return amount.value

    assert speed(f"drive at {value} mph") == pytest.approx(value * MPS_PER_MPH)
    assert speed(f"drive at {value} km/h") == pytest.approx(value * MPS_PER_KMH)
    assert speed(f"drive at {value} m/s") == pytest.approx(value)
    assert speed(f"drive at {value * 1.609344:.6f} kilometers per hour") == pytest.approx(speed(f"go {value}mph"), 1e-5)


@given(st.text(max_size=200))
def test_never_raises_on_any_text(text: str) -> None:
    assert isinstance(understand(text), Reading | NotUnderstood)


_WORDS = sorted({word for wish in MEANT for word in wish.split()} | {"#0", "#9", "~~", "not", "half", "twenty", ","})


@given(st.lists(st.sampled_from(_WORDS), min_size=1, max_size=14))
def test_never_raises_on_shuffled_wishes(words: list[str]) -> None:
    assert isinstance(understand(" ".join(words)), Reading | NotUnderstood)
