"""Examples: cases put into words, with histories, questions and refusals; what the network is trained on.

An example is a prompt and its reply. The program in a reply is that of a case, so it was driven and did what it says;
the words come from the grammar of this package and say exactly that program.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np

from chauffeur.concept import Situation
from chauffeur.models.onboard.cases import Case
from chauffeur.models.onboard.noise import noisy, reworded, said_in_full
from chauffeur.models.onboard.speech import Unit, spoken
from chauffeur.models.onboard.wordings import because, beside, clause, conditioned, in_order, levels, utter, wordings
from chauffeur.planners.onboard.dialect import CONDITIONS, SKILLS, DialectStep, Kind, Number
from chauffeur.planners.onboard.prompt import ASK, REFUSE, program_reply, prompt, remembered

Generator = np.random.Generator

HISTORY_SHARE: Final = 0.35
"""Share of plain wishes that come with remembered trips which have nothing to do with them."""
CORRECTION_SHARE: Final = 0.12
IN_FULL_SHARE: Final = 0.15
"""Share of sentences without contractions: "I am late"."""
UNKNOWN_CONTEXT_SHARE: Final = 0.08
CHATTER_SHARE: Final = 0.05
"""Share of examples of training with a sentence beside the wish that wishes for nothing."""
REASON_SHARE: Final = 0.12
"""Share of single wishes of training that are said with a reason or a complaint; what is said outright counts."""
REWORDED_SHARE: Final = 0.3
"""Share of sentences of training in which words are exchanged for others of the same meaning."""
MOST_REASONED: Final = 140
"""Characters of a sentence from which nothing is put beside it."""
LEVELS: Final = (0.46, 0.29, 0.25)
NOISE: Final = (0.55, 0.3, 0.15)

SAID: Final = (
    "good", "good", "", "too fast", "a bit too fast", "too slow", "a bit too slow", "too close", "a bit too far",
    "too rough", "a bit too close", "too far",
)  # fmt: skip
"""What a remembered passenger may have said."""

IMPOSSIBLE: Final = (
    (re.compile(r"lane|shoulder|emergency"), "There is no such lane for us here."),
    (re.compile(r"vehicle ahead|overtake"), "There is nobody ahead for that."),
    (re.compile(r"junction"), "There is no junction ahead of us for that."),
)
NOT_HERE: Final = "That is not possible here."
WHICH_SIDE: Final = "To which side, left or right?"

LESS: Final = {
    "much_faster": "faster", "faster": "a_bit_faster", "much_slower": "slower", "slower": "a_bit_slower",
    "much_closer": "closer", "closer": "a_bit_closer", "much_further": "further", "further": "a_bit_further",
}  # fmt: skip
_QUICK: Final = ("hurry/2", "hurry/3", "faster/2")
_CALM: Final = ("carefully/3", "gently/3", "relax/3", "slower/2")
_ROOM: Final = ("carefully/3", "gently/3", "further/2", "further/3")
REASONS: Final[dict[str, tuple[str, ...]]] = {
    **dict.fromkeys(("faster", "a_bit_faster", "much_faster", "faster_by", "as_fast_as_allowed", "at_least"), _QUICK),
    **dict.fromkeys(("slower", "a_bit_slower", "much_slower", "slower_by", "at_most", "under_limit_by"), _CALM),
    **dict.fromkeys(("further", "a_bit_further", "much_further", "further_by", "gap_at_least"), _ROOM),
    **dict.fromkeys(("closer", "a_bit_closer", "much_closer", "closer_by", "gap_at_most"), ("closer/2", "hurry/3")),
    **dict.fromkeys(("drive_at", "gap_of", "gap_of_seconds", "keep_lane", "hold_speed"), ("carefully/3", "gently/3")),
    **dict.fromkeys(("overtake", "overtake_and_return"), ("overtake/2", "overtake/3", "hurry/3")),
    **dict.fromkeys(("lane_left", "overtake_left", "lanes_left", "leftmost_lane"), ("lane_left/2", "hurry/3")),
    **dict.fromkeys(("lane_right", "overtake_right", "lanes_right", "rightmost_lane"), ("lane_right/2", "hurry/3")),
    **dict.fromkeys(("stop_here",), ("stop_here/3", "pull_over/3")),
    **{
        skill: (f"{skill}/2", f"{skill}/3")
        for skill in ("hurry", "relax", "gently", "carefully", "sportily", "economically", "pull_over")
    },
    **{
        skill: (f"{skill}/2",)
        for skill in ("turn_left", "turn_right", "go_straight", "follow", "let_in", "no_overtaking", "match_traffic")
    },
    **{
        skill: (f"{skill}/2",)
        for skill in ("middle_lane", "back_on_the_road", "drive_at_limit", "hold_gap", "carry_on")
    },
}
"""Sections of reasons and complaints that go with a skill's wish said outright."""

HOLDS: Final = ("hold_speed", "hold_gap", "carry_on")
"""What keeps the present: "the same speed as last time" is not that."""
BELOW: Final = ("under_limit_by",)
"""Skills whose larger number is a lower speed."""
MORE: Final = {weak: strong for strong, weak in LESS.items()}
LESS_FACTOR, MORE_FACTOR = 0.85, 1.15


@dataclass(frozen=True, slots=True)
class Example:
    """An example.

    Attributes:
        prompt: What the model reads.
        reply: What it is to write.
        wish: The words alone.
        template: Grammar template they came from.
        skills: Skills of the program; `ask` or `refuse` where there is none.
        directness: 1, 2 or 3; 0 where it was not varied.
        noise: Level of noise.
        held: Whether the words are of templates that training never uses.
        kind: `wish`, `correction`, `ask` or `refuse`.
        case: Number of the case.
    """

    prompt: str
    reply: str
    wish: str
    template: str
    skills: str
    directness: int
    noise: int
    held: bool
    kind: str
    case: int


def refusal_reply(words: str) -> str:
    """The reply for a reason that linking gave: a question stays one, a reason becomes one of a few."""
    if words.endswith("?") and "left or right" in words:
        return f"{ASK}{WHICH_SIDE}"
    reason = next((reason for pattern, reason in IMPOSSIBLE if pattern.search(words)), NOT_HERE)
    return f"{REFUSE}{reason}"


def questions() -> tuple[str, ...]:
    """Everything the model may ask back."""
    grammar = wordings()
    return tuple(dict.fromkeys([WHICH_SIDE, *(q for s in grammar.sections() if (q := grammar.question(s)))]))


def reasons() -> tuple[str, ...]:
    """Every reason the model may give."""
    grammar = wordings()
    impossible = [reason for _, reason in IMPOSSIBLE]
    return tuple(dict.fromkeys([*impossible, NOT_HERE, *(r for s in grammar.sections() if (r := grammar.reason(s)))]))


def checked_reasons() -> tuple[str, ...]:
    """Reasons that the road and the limits decide: the model may give them, and is not believed."""
    grammar = wordings()
    numbers = (grammar.reason(section) for section in ("refuse.unsafe_speed", "refuse.unsafe_gap"))
    return tuple(dict.fromkeys([*(reason for _, reason in IMPOSSIBLE), NOT_HERE, *numbers]))


def wish_example(case: Case, rng: Generator, *, held: bool, wider: bool = False) -> Example:
    """An example of a case; `wider` says it with reasons, other words and talk beside it, as training does."""
    words, template, level = _wish(case.steps, rng, held=held)
    if wider and level == 1 and rng.random() < REASON_SHARE and case.steps[0].skill in REASONS:
        reasons_of = REASONS[case.steps[0].skill]
        if len(case.steps) == 1 and len(words) < MOST_REASONED:
            words = because(words, reasons_of[int(rng.integers(len(reasons_of)))], rng)
    words, noise = _arriving(words, rng, wider=wider)
    reply = refusal_reply(case.refusal) if case.refusal else program_reply(case.steps)
    known = bool(case.refusal) or _needs_context(case.steps) or rng.random() >= UNKNOWN_CONTEXT_SHARE
    history = _other_history(rng) if rng.random() < HISTORY_SHARE else ()
    text = prompt(case.situation if known else None, history, words)
    skills = "+".join(step.skill for step in case.steps)
    return Example(text, reply, words, template, skills, level, noise, held, "wish", case.index)


def correction_example(case: Case, rng: Generator, *, held: bool, wider: bool = False) -> Example | None:
    """A wish that refers to a remembered trip; None where a case gives none."""
    step = case.steps[0]
    if case.refusal or len(case.steps) > 1 or step.condition is not None or step.wait_s is not None or step.manner:
        return None
    ways = ["same"]
    if step.skill in LESS or _scalable(step):
        ways.append("less")
    if step.skill in MORE or _scalable(step):
        ways.append("more")
    way = ways[int(rng.integers(len(ways)))]
    about = SKILLS[step.skill].meaning.manoeuvre
    named = about in ("speed", "gap") and step.skill not in HOLDS and rng.random() < 0.5
    wording = utter(f"correction.{about}_{way}" if named else f"correction.{way}", {}, rng, held)
    if named and (step.meaning.change < 0 or step.skill in BELOW) and way != "same":
        # Of what slows down or closes up, "slower than last time" is more, not less.
        way = "more" if way == "less" else "less"
        if step.number is None and step.skill not in (LESS if way == "less" else MORE):
            return None
    wanted = step
    if way != "same":
        if step.number is not None:
            wanted = replace(step, number=replace(step.number, factor=LESS_FACTOR if way == "less" else MORE_FACTOR))
        else:
            wanted = replace(step, skill=(LESS if way == "less" else MORE)[step.skill])
    words, noise = _arriving(wording.text, rng, wider=wider)
    history = [remembered([step], str(rng.choice(SAID))), *_other_history(rng)[:1]]
    return Example(
        prompt(case.situation, history, words),
        program_reply([wanted]),
        words,
        wording.template,
        wanted.skill,
        0,
        noise,
        held,
        "correction",
        case.index,
    )


def answer_example(
    section: str, situation: Situation | None, rng: Generator, *, held: bool, wider: bool = False
) -> Example:
    """A wish to ask back about, or to refuse, wherever we are."""
    wording = utter(section, _free_slots(section, rng), rng, held)
    words, noise = _arriving(wording.text, rng, wider=wider)
    question, reason = wordings().question(section), wordings().reason(section)
    reply = f"{ASK}{question}" if question else f"{REFUSE}{reason}"
    history = _other_history(rng) if rng.random() < HISTORY_SHARE else ()
    kind = "ask" if question else "refuse"
    text = prompt(situation, history, words)
    return Example(text, reply, words, wording.template, kind, 0, noise, held, kind, -1)


def _arriving(words: str, rng: Generator, *, wider: bool) -> tuple[str, int]:
    """A sentence as it may arrive, and how noisy that is."""
    if wider:
        if rng.random() < REWORDED_SHARE:
            words = reworded(words, rng)
        if rng.random() < CHATTER_SHARE and len(words) < MOST_REASONED:
            words = beside(words, rng)
    noise = int(rng.choice(3, p=NOISE))
    return noisy(said_in_full(words) if rng.random() < IN_FULL_SHARE else words, rng, noise), noise


def answer_sections(situation: Situation) -> tuple[str, ...]:
    """Sections whose wishes are asked back about or refused in a situation."""
    sections = tuple(s for s in wordings().sections() if s.startswith(("ask.", "refuse.")))
    out = () if situation.turns else ("ask.turn",)
    out += () if situation.front is not None else ("ask.gap_amount", "ask.gap_change", "ask.unit_gap")
    return tuple(section for section in sections if section not in out)


def _needs_context(steps: Sequence[DialectStep]) -> bool:
    """True if what is meant depends on where we are: "the other lane"."""
    return any(step.skill == "change_lane" for step in steps)


def _scalable(step: DialectStep) -> bool:
    return step.number is not None and SKILLS[step.skill].takes in ("speed", "distance", "time")


def _wish(steps: Sequence[DialectStep], rng: Generator, *, held: bool) -> tuple[str, str, int]:
    """(words, template, directness) for some steps."""
    if len(steps) == 1:
        return _single(steps[0], rng, held=held)
    parts = [_imperative(step, rng, held=held) for step in steps]
    wording = in_order([words for words, _ in parts], rng, held)
    return wording.text, "+".join([wording.template, *(template for _, template in parts)]), 1


def _single(step: DialectStep, rng: Generator, *, held: bool) -> tuple[str, str, int]:
    if step.condition is not None or step.wait_s is not None:
        words, template = _imperative(step, rng, held=held)
        when, own = _when(step, rng, held=held)
        wording = conditioned(when, words, rng, held)
        return wording.text, f"{wording.template}+{own}+{template}", 1
    if step.manner:
        words, template = _imperative(step, rng, held=held)
        return words[0].upper() + words[1:], template, 1
    known = levels(step.skill)
    level = int(rng.choice(3, p=LEVELS))
    section = known[level] if level < len(known) else step.skill
    if held and not wordings().templates(section, held=True):
        section = step.skill
    if section == "speed_times" and step.number in _NAMED_FACTORS and rng.random() < 0.4:
        wording = utter(_NAMED_FACTORS[step.number], {}, rng, held)
        return wording.text, wording.template, 1
    wording = utter(section, _slots(step, rng), rng, held)
    return wording.text, wording.template, int(section.partition("/")[2] or 1)


def _imperative(step: DialectStep, rng: Generator, *, held: bool) -> tuple[str, str]:
    """The bare imperative of a step, with its manner."""
    grammar = wordings()
    spare = not any(not t.sentence and not t.part for t in grammar.templates(step.skill, held=held))
    wording = clause(step.skill, _slots(step, rng), rng, held=False if spare else held)
    words = wording.text
    if step.manner:
        manner = utter(f"manner.{step.manner}", {}, rng, held).text
        words = f"{words} {manner}" if rng.random() < 0.6 else f"{words}, {manner}"
    return words, wording.template


def _when(step: DialectStep, rng: Generator, *, held: bool) -> tuple[str, str]:
    """The condition of a step, or its wait; a step with both says the wait within the condition."""
    if step.condition is None:
        assert step.wait_s is not None
        wording = utter("wait", {"t": spoken(step.wait_s.value, "s", rng)}, rng, held)
        return wording.text, wording.template
    kind = CONDITIONS[step.condition.name][0]
    slots: dict[str, str] = {}
    if kind is not None and step.condition.number is not None:
        slots = {"v" if kind == "speed" else "d": _said(step.condition.number, kind, rng)}
    wording = utter(f"{step.condition.how}.{step.condition.name}", slots, rng, held)
    return wording.text, wording.template


def _slots(step: DialectStep, rng: Generator) -> dict[str, str]:
    takes = SKILLS[step.skill].takes
    if takes is None or step.number is None:
        return {}
    name = {"speed": "v", "distance": "d", "time": "t", "factor": "k", "lanes": "k"}[takes]
    return {name: _said(step.number, takes, rng)}


_UNIT_NAMES: Final[dict[str, Unit]] = {
    "mph": "mph", "kmh": "kmh", "feet": "ft", "yards": "yd", "car_lengths": "car lengths",
}  # fmt: skip
_SI_NAMES: Final[dict[Kind, Unit]] = {"speed": "mps", "distance": "m", "time": "s", "factor": "times", "lanes": "lanes"}
_NAMED_FACTORS: Final = {Number(0.5): "speed_times.half", Number(2.0): "speed_times.double"}


def _said(number: Number, kind: Kind, rng: Generator) -> str:
    return spoken(number.value, _UNIT_NAMES[number.unit] if number.unit else _SI_NAMES[kind], rng)


def _free_slots(section: str, rng: Generator) -> dict[str, str]:
    """Values for wishes that are refused whatever they are: speeds far beyond any limit, gaps of no length."""
    names = _slot_names(section)
    out: dict[str, str] = {}
    if "v" in names:
        fast: tuple[tuple[Unit, int, int], ...] = (("mph", 110, 250), ("kmh", 190, 400), ("mps", 50, 110))
        unit, low, high = fast[int(rng.integers(3))]
        out["v"] = spoken(float(5 * rng.integers(low // 5, high // 5)), unit, rng)
    if "d" in names:
        short: tuple[tuple[Unit, int], ...] = (("m", 4), ("ft", 12), ("yd", 4))
        unit, high = short[int(rng.integers(3))]
        out["d"] = spoken(float(rng.integers(1, high + 1)), unit, rng)
    if "t" in names:
        out["t"] = spoken(float(rng.choice((0.1, 0.2, 0.5))), "s", rng)
    if "k" in names:
        out["k"] = str(rng.choice(("ten times", "five times", "four times")))
    if "n" in names:
        out["n"] = str(int(rng.integers(2, 120)))
    return out


@cache
def _slot_names(section: str) -> frozenset[str]:
    return frozenset[str]().union(*(wordings().slots(t) for t in wordings().templates(section)))


_REMEMBERED: Final = tuple(
    DialectStep(what)
    for what in (
        "hurry",
        "gently",
        "relax",
        "faster",
        "much_slower",
        "closer",
        "a_bit_further",
        "lane_left",
        "lane_right",
        "overtake_left",
        "pull_over",
        "turn_left",
        "turn_right",
    )
)


def _other_history(rng: Generator) -> list[str]:
    """Remembered trips that the wish has nothing to do with."""
    out: list[str] = []
    for _ in range(1 + int(rng.random() < 0.5)):
        draw = rng.random()
        if draw < 0.35:
            step = DialectStep("drive_at", Number(float(rng.integers(8, 36))))
        elif draw < 0.6:
            step = DialectStep("gap_of", Number(float(rng.integers(12, 75))))
        else:
            step = _REMEMBERED[int(rng.integers(len(_REMEMBERED)))]
        out.append(remembered([step], str(rng.choice(SAID))))
    return out
