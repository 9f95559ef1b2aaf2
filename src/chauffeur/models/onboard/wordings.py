"""Sentences of passengers for the skills of the dialect, drawn from the tables in `data/onboard`.

Sections have the names of the dialect's functions. A bare name is a wish said directly ("go faster"); `/2` is a
complaint ("this is slow") and `/3` a mere reason ("my flight leaves in forty minutes") that a reasonable driver
answers with that skill. `ask.*` are wishes to ask back about, `refuse.*` wishes to refuse, `if.*`, `once.*` and `wait`
clauses to be put around others, `correction.*` wishes that refer to what was driven before.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from chauffeur.concept.data import data_folder
from chauffeur.language.grammar import Grammar, GrammarFrame, Manner, Template, Wording

DATA = "onboard"
"""Their data set."""
FILES = (
    "pieces", "speed", "gap", "lanes", "passing", "road", "others", "styles", "conditions", "asks", "refusals",
    "corrections", "wide", "more", "numbers", "pace", "distance", "lane_talk", "manoeuvres", "moods", "answers",
    "compound", "again", "pace_felt", "room_felt", "not_driven", "plain_rare", "steps_more", "voices_moods",
    "voices_pace", "voices_numbers", "voices_room", "voices_lanes", "voices_answers", "voices_joins", "small_talk",
    "never", "measured", "unclear", "manners", "ways", "chatter",
)  # fmt: skip

_NOT = r"^(?:don't|do not|never|neither|no|patiently|really|not|either)\b"
"""Imperatives that no "could you" goes in front of."""
_MANY = re.compile(_NOT + r"|\band\b|\bthen\b|\bbut\b|,")
"""Imperatives of several verbs, of which a gerund would change only the first."""
_NOT_ONLY = re.compile(_NOT)
_OF_US = re.compile(_NOT + r"|\b(?:us|your|yourself|you|me|my)\b")
"""Imperatives that do not go with "let's" and "we"."""
_TIMED = re.compile(
    r"\b(?:now|when|once|whenever|here|there|until|at the|if|moment|from|again|after|while|for|as soon|please)\b|,"
)
"""Imperatives that end badly with "now" or "for me"."""
_PATIENT = re.compile(
    r"\b(?:lanes?|left|right|over|merge|pass|past|overtak\w*|stop|halt|now|here|when|once|until|moment|turn|shoulder|"
    r"straight|at the|if|whenever|as soon)\b|" + _NOT
)
"""Imperatives whose meaning "when you get a chance" would change: a lane change that waits is another skill."""
_POLITE = re.compile(r"\b(?:please|thanks|thank you)\b|" + _NOT)
_ENDED = re.compile(r"[.?!]$")
_CALLED = re.compile(r"^(?:hey|sorry|ok|okay|oh|look|listen|well|um|hmm|hi|hello|please|whoa|come on|er|wow|man|god)\b")

_CLASH = re.compile(
    r"\b(?:you|to|we|let's|just|can|could|should|may) (?:first |please )?(?:don't|do not|neither|no)\b|please,? please"
)
"""Joints that nobody makes: "could you don't"."""
_TRIES = 12
MAX_CHARS = 200
"""A sentence of several wishes that comes out longer is said another way, if there is one."""
MOST_FORMS = 8
"""A template is drawn as often as there are ways of saying it, but no more than so many times as often: one rule for
training and tests, or phrasings of one way of saying would weigh more among those never seen."""

_BESIDE = (
    "{c}. {w}", "{c}. {w}", "{c}, {w}", "{c}, anyway, {w}", "{c}, so, {w}", "{c}. Anyway, {w}", "{c}. Right, {w}",
    "{c}. Oh, {w}", "{w} {c}.", "{w} {c}.", "{w} By the way, {c}.", "{w} {c}, by the way.", "{w} You know, {c}.",
)  # fmt: skip
"""A wish with a sentence beside it that wishes for nothing."""
_BECAUSE = (
    "{c}. {w}", "{c}. {w}", "{c}, {w}", "{c}, so {w}", "{c}. So {w}", "{c}. Please, {w}", "{w} {c}.", "{w} {c}.",
    "{w} It's just that {c}.", "{w} You see, {c}.",
)  # fmt: skip
"""A wish with its reason."""

_NAME = "(driver|car|chauffeur|buddy|mate|pal|man|my friend|boss|sir|dude|love|dear|robot|James)"
_HEY = "(hey|okay|ok|alright|so|well|um|uh|look|listen|sorry|oh|yo|hi|excuse me|now then|hello|hm)"

_FRAMES: Sequence[GrammarFrame] = (
    *[GrammarFrame("{body}")] * 12,
    *[GrammarFrame("please {body}", unless=re.compile(r"\bplease\b"))] * 2,
    *[GrammarFrame("{body}, please", unless=re.compile(r"\bplease\b"))] * 2,
    GrammarFrame("{body} please", unless=re.compile(r"\bplease\b")),
    *[GrammarFrame("(could|can|would|will) you {body}?", unless=_POLITE)] * 3,
    *[GrammarFrame("(could|can|would) you please {body}?", unless=_POLITE)] * 2,
    GrammarFrame("(could|can) you (maybe|possibly|perhaps|kindly) {body}?", unless=_POLITE),
    *[GrammarFrame("I('d like| want| need| would like|'d want|'d love) you to {body}", unless=_POLITE)] * 2,
    GrammarFrame(f"{_HEY}, {{body}}"),
    GrammarFrame(f"{_NAME}, {{body}}"),
    GrammarFrame(f"{{body}}, {_NAME}"),
    GrammarFrame(f"{_HEY} {_NAME}, (could you |can you |please |would you |){{body}}", unless=_POLITE),
    GrammarFrame("{body} now", unless=_TIMED),
    GrammarFrame("{body} for me", unless=re.compile(_TIMED.pattern + r"|\b(?:us|me|car)\b")),
    *[GrammarFrame("let's {body}", unless=_OF_US)] * 2,
    GrammarFrame(
        "(we should|we could|could we|can we|we can|we'd better|we need to|why don't we) {body}", unless=_OF_US
    ),
    GrammarFrame("(maybe|perhaps) {body}", unless=_NOT_ONLY),
    GrammarFrame("maybe (you could|you can|you should|we could) {body}", unless=_OF_US),
    GrammarFrame("(if you don't mind|if it's okay with you|if that's alright|if I may ask), {body}", unless=_PATIENT),
    GrammarFrame("{body}, if you (don't mind|would|would be so kind|please)", unless=re.compile(r"\bplease\b")),
    GrammarFrame("{body} when you (get a chance|can|get a moment|get the chance)", unless=_PATIENT),
    GrammarFrame("if you could {body}, (that would be|that'd be) (great|nice|lovely|good|wonderful)", unless=_POLITE),
    GrammarFrame("I was (wondering if|hoping) you could {body}", unless=_POLITE),
    GrammarFrame("(would it be|is it) (possible|okay|alright) to {body}?", unless=_POLITE),
    GrammarFrame("(any chance|do you think|is there any chance) you could {body}?", unless=_POLITE),
    GrammarFrame("(be a dear|do me a favor|do me a favour|be so kind|be a sport|be nice) and {body}", unless=_POLITE),
    GrammarFrame("go ahead and {body}", unless=_POLITE),
    GrammarFrame("you (can|could|should|may|might want to|ought to|had better) {body}", unless=_POLITE),
    GrammarFrame("I think you (should|could|can) {body}", unless=_POLITE),
    GrammarFrame("(why don't you|how about you|what if you) {body}?", unless=_POLITE),
    GrammarFrame("(just|simply) {body}", unless=re.compile(_NOT + r"|^just\b")),
    GrammarFrame("(sorry to bother you|pardon me|excuse me), but could you {body}?", unless=_POLITE),
    GrammarFrame("I'd (appreciate it|be grateful|be happy|be glad) if you could {body}", unless=_POLITE),
    GrammarFrame("kindly {body}", unless=_POLITE),
    GrammarFrame("{body}, (thanks|thank you|cheers|ta|thx|thank you very much|many thanks)", unless=_POLITE),
    GrammarFrame(
        "{body}, (would you|will you|could you|okay|yeah|alright|ok)?", unless=re.compile(_NOT + r"|\bplease\b")
    ),
    GrammarFrame(
        "(gonna need you|gotta ask you|I have to ask you|I must ask you|may I ask you) to {body}", unless=_POLITE
    ),
    GrammarFrame("(for heaven's sake|for god's sake|come on|dude|oi|man), {body}"),
    GrammarFrame("{body} already", unless=re.compile(_TIMED.pattern + "|" + _NOT)),
    GrammarFrame("(ok so|so yeah|alright so|so basically) {body}"),
    GrammarFrame(
        "I (want|wish|need|expect) the car to {body}", unless=re.compile(_POLITE.pattern + r"|\b(?:car|us|your)\b")
    ),
    GrammarFrame("(time to|it's time to|I'd say it's time to|we have to) {body}", unless=_OF_US),
    GrammarFrame("you (must|have to|need to|gotta) {body}", unless=_POLITE),
    GrammarFrame("(quick request|one more thing|a small wish|new wish|here's what I'd like|request), {body}"),
    GrammarFrame("(I've been thinking|as I said|like I said|if you ask me|you know what|tell you what), {body}"),
    GrammarFrame("{body}, (that's all|that's it|if possible|if that works|if you get me|you know)"),
    GrammarFrame(
        "(what I want is that you|my wish is that you|I'd be thankful if you|it'd be nice if you) {body}",
        unless=_POLITE,
    ),
    GrammarFrame(
        "(my wife|my mum|my husband|the lady next to me|my boss|everyone back here) wants you to {body}", unless=_POLITE
    ),
    GrammarFrame("(is it allowed to|are you able to|would you be able to|may I get you to) {body}?", unless=_POLITE),
    GrammarFrame("(please to|you please|be so good to|can be you|must please) {body}", unless=_POLITE),
    GrammarFrame("(make|have) the car {body}", unless=re.compile(_POLITE.pattern + r"|\b(?:car|us|our|your)\b")),
    GrammarFrame("(wanna|could ya|can ya|wouldya|would ya|mind if I ask you to) {body}?", unless=_POLITE),
    GrammarFrame("I (really need|really want|just want|simply want|would really like) you to {body}", unless=_POLITE),
    GrammarFrame("(whenever you're ready|in your own time|when convenient), {body}", unless=_PATIENT),
    *[GrammarFrame("would you mind {ing}?", unless=_MANY)] * 2,
    GrammarFrame("(how about|what about) {ing}?", unless=_MANY),
    GrammarFrame("(do you mind|mind) {ing}?", unless=_MANY),
    GrammarFrame("I'd (appreciate|like) you {ing}", unless=_MANY),
    GrammarFrame("I wouldn't mind you {ing}", unless=_MANY),
    GrammarFrame("(consider|try) {ing}", unless=_MANY),
)

_OPENINGS: Sequence[GrammarFrame] = (
    *[GrammarFrame("{body}")] * 13,
    *[GrammarFrame(f"{_HEY}, {{body}}", unless=_CALLED)] * 2,
    GrammarFrame(f"{_NAME}, {{body}}", unless=_CALLED),
    GrammarFrame(f"{_HEY} {_NAME}, {{body}}", unless=_CALLED),
    GrammarFrame(
        f"{{body}}, {_NAME}",
        unless=re.compile(
            _ENDED.pattern
            + r"|\b(?:driver|mate|buddy|man|dude|please|sir|dear|love|pal|boss|friend|robot|James|chauffeur)$"
        ),
    ),
    GrammarFrame(
        "(one more thing|quick one|another thing|I was just thinking|something else|as I said|like I said), {body}",
        unless=_CALLED,
    ),
    GrammarFrame(
        "(I don't want to be rude but|no offence but|forgive me but|don't get me wrong, but) {body}", unless=_CALLED
    ),
    GrammarFrame(
        "{body}, (if you ask me|if I may say so|that's all|okay|just so you know|is all I'm saying)",
        unless=re.compile(_ENDED.pattern + r"|\bplease\b|^(?:can|could|let's|how about|what about)\b"),
    ),
    GrammarFrame("(you know|honestly|to be honest|frankly|just saying|sorry but|I must say), {body}", unless=_CALLED),
    GrammarFrame(
        "{body}, (you know|to be honest|I must say|honestly)",
        unless=re.compile(_ENDED.pattern + r"|\bplease\b|^(?:can|could|let's|how about|what about)\b"),
    ),
)

_QUESTIONS = (
    "could you", "can you", "would you", "will you", "can we", "could we", "can't we", "may i have", "could i have",
    "can i", "how about", "what about", "why don't", "would it be", "is it possible", "any chance", "do you think",
    "may i ask", "is there any",
)  # fmt: skip

_GERUNDS: Mapping[str, str] = json.loads(Path(__file__).with_name("gerunds.json").read_text(encoding="utf-8"))

MANNER = Manner(
    frames=_FRAMES,
    openings=_OPENINGS,
    questions=_QUESTIONS,
    gerunds=_GERUNDS,
    unfinished=0.25,
    loud=0.04,
)


@cache
def wordings() -> Grammar:
    """The tables of what passengers say."""
    return Grammar(data_folder(DATA), FILES, MANNER)


def levels(skill: str) -> tuple[str, ...]:
    """Sections of a skill, most direct first: `faster`, `faster/2`, ...; empty if it has none."""
    known = wordings().sections()
    return tuple(name for name in (skill, f"{skill}/2", f"{skill}/3") if name in known)


def utter(section: str, slots: Mapping[str, str], rng: np.random.Generator, held: bool | None = False) -> Wording:
    """A sentence of a section, all its templates equally likely.

    Args:
        section: Name, with its level: `faster`, `faster/2`, `ask.side`.
        slots: Texts for the slots of the section.
        rng: Random draws.
        held: False for templates of training, True for those held out, None for all.

    Raises:
        KeyError: The section is unknown, or a slot has no text.
    """
    return wordings().say(_drawn(section, held, False, rng), slots, rng)


def clause(section: str, slots: Mapping[str, str], rng: np.random.Generator, held: bool | None = False) -> Wording:
    """The same without frames and endings: an imperative, or a condition, to be put into a longer sentence.

    Raises:
        KeyError: The section is unknown, or a slot has no text.
    """
    return wordings().clause(_drawn(section, held, True, rng), slots, rng)


def conditioned(condition: str, wish: str, rng: np.random.Generator, held: bool | None = False) -> Wording:
    """A sentence of a condition or a wait and an imperative, both from `clause`."""
    section = "conditioned.then" if condition.endswith(" then") else "conditioned"
    return _joined(section, {"if": condition, "a": wish}, rng, held)


def in_order(wishes: Sequence[str], rng: np.random.Generator, held: bool | None = False) -> Wording:
    """A sentence of two or three imperatives from `clause`, in their order."""
    section = "steps" if len(wishes) == 2 else "steps3"
    return _joined(section, dict(zip("abc", wishes, strict=False)), rng, held)


def _joined(section: str, slots: Mapping[str, str], rng: np.random.Generator, held: bool | None) -> Wording:
    """A sentence of parts. Nobody says "could you don't": another template is drawn for those."""
    found = utter(section, slots, rng, held)
    for _ in range(_TRIES):
        if not _CLASH.search(found.text) and len(found.text) <= MAX_CHARS:
            break
        found = utter(section, slots, rng, held)
    return found


def beside(wish: str, rng: np.random.Generator) -> str:
    """A wish with a sentence of training beside it that has nothing to do with it."""
    return _put_together(_BESIDE, "chatter", wish, rng)


def because(wish: str, reason: str, rng: np.random.Generator) -> str:
    """A wish with its reason or complaint, from a section of sentences without slots, as training says it."""
    return _put_together(_BECAUSE, reason, wish, rng)


def _put_together(ways: Sequence[str], section: str, wish: str, rng: np.random.Generator) -> str:
    grammar = wordings()
    words = grammar.clause(_drawn(section, False, False, rng), {}, rng).text
    way = ways[int(rng.integers(len(ways)))]
    if not wish.endswith((".", "?", "!")):
        wish += "."
    if not way.startswith("{w}") and not way.startswith("{c}. {w}"):
        wish = wish if re.match(r"I\b", wish) else wish[0].lower() + wish[1:]
    if words.endswith(("?", "!")):
        way = way.replace("{c}.", "{c}").replace("{c}, so ", "{c} ").replace("{c},", "{c}")
    if way.startswith("{c}") or way == "{w} {c}.":
        words = words[0].upper() + words[1:]
    return way.replace("{c}", words).replace("{w}", wish)


@cache
def _lot(section: str, held: bool | None, bare: bool) -> tuple[Sequence[Template], np.ndarray]:
    """Templates of a section, and the shares they are drawn with, summed up."""
    grammar = wordings()
    found = [t for t in grammar.templates(section, held=held) if not (bare and t.sentence)]
    return found, np.cumsum([min(MOST_FORMS, grammar.forms(t)) for t in found])


def _drawn(section: str, held: bool | None, bare: bool, rng: np.random.Generator) -> Template:
    found, shares = _lot(section, held, bare)
    return found[int(np.searchsorted(shares, rng.integers(shares[-1]), side="right"))]
