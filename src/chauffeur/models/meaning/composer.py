"""Composing sentences with their meaning: acts are drawn first, then said in a writer's phrases.

Frequencies of verbs, places and conditions are those that people's commands have, not uniform. What stands in the text
itself is marked while it is said: `<k` and `k>` around the words of act k, `<n` and `n>` around a name, `#` before a
number. `finish` takes the marks out and gives word indices.
"""

from __future__ import annotations

import re
from bisect import bisect
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Any, Final, cast, get_args

import numpy as np

from chauffeur.concept.utterance import (
    Act,
    ActPlace,
    Address,
    Condition,
    Direction,
    LaneAim,
    Manner,
    Reference,
    ReferenceKind,
    Relation,
    Verb,
)
from chauffeur.language.meaning.symbols import WrittenAct
from chauffeur.language.quantities import ONES, TENS
from chauffeur.models.meaning.banks import Bank, chosen

Weights = Mapping[str, float]

VERBS: Final[Weights] = {
    "turn": 24, "stop": 15, "lane": 13, "park": 9, "avoid": 6, "follow": 8, "go": 4, "speed": 10, "straight": 6,
    "yield": 5, "wait": 4, "keep": 3, "move": 2, "enter": 2, "pull_over": 4, "u_turn": 2, "pass": 5, "exit": 1.5,
    "gap": 4, "goto": 3, "refuse": 2.5,
}  # fmt: skip
"""About the shares of verbs in commands for a car in traffic, the rare ones raised so that they are learned."""
PLACED: Final[Mapping[str, tuple[float, Weights]]] = {
    "turn": (0.5, {"at": 26, "here": 5, "into": 7, "next": 6, "after": 6, "before": 2, "near": 1}),
    "stop": (0.9,
        {"at": 10, "beside": 13, "near": 7, "behind": 7, "before": 6, "here": 4, "in_front_of": 3, "after": 1,
        "opposite": 1, "next": 1}),
    "park": (0.95,
        {"near": 11, "beside": 11, "behind": 9, "in_front_of": 6, "at": 1, "after": 1.5, "here": 2, "into": 2,
        "on": 1, "opposite": 1}),
    "pull_over": (0.6,
        {"near": 3, "beside": 4, "before": 2, "behind": 3, "in_front_of": 2, "here": 3, "after": 2, "at": 2,
        "next": 1}),
    "lane": (0.08, {"beside": 1, "in_front_of": 2, "behind": 2, "before": 2, "after": 2, "at": 1}),
    "speed": (0.3, {"near": 6, "at": 4, "behind": 3, "before": 3, "after": 1, "beside": 1}),
    "straight": (0.2, {"at": 8, "on": 2}),
    "go": (0.08, {"on": 1}),
    "wait": (0.3, {"here": 4, "at": 4, "before": 3, "behind": 3, "beside": 1}),
    "u_turn": (0.35, {"at": 5, "here": 2, "after": 1, "next": 2}),
    "exit": (0.3, {"at": 2, "next": 2}),
}  # fmt: skip
"""Frequencies with which an act names a place, and which relation."""
_WAYS: Final[Weights] = {
    "junction": 26, "light": 6, "stop_sign": 4, "roundabout": 3, "end_of_road": 3, "crosswalk": 2, "road": 3, "sign": 1,
    "building": 2, "driveway": 1,
}  # fmt: skip
_THINGS: Final[Weights] = {
    "car": 18, "pedestrian": 12, "truck": 6, "bicycle": 5, "van": 4, "vehicle": 3, "bus": 3, "other": 7, "barrier": 2,
    "cone": 3, "sidewalk": 2, "motorcycle": 2, "sign": 2, "light": 1, "building": 4, "vehicles": 1, "pedestrians": 2,
    "lot": 1, "stop_sign": 1, "obstacle": 1, "landmark": 2, "gate": 1, "driveway": 1, "junction": 2, "crosswalk": 2,
    "animal": 0.5,
}  # fmt: skip
TARGETS: Final[Mapping[str, Weights]] = {
    "follow": {"car": 18, "bus": 3, "vehicle": 5, "van": 4, "truck": 5, "bicycle": 2, "motorcycle": 2,
        "vehicles": 1, "traffic": 1, "pedestrian": 1},
    "avoid": {"obstacle": 7, "car": 5, "vehicle": 4, "bus": 2, "truck": 3, "pedestrian": 5, "pedestrians": 2,
        "cone": 3, "barrier": 2, "bicycle": 2, "vehicles": 2, "traffic": 1, "motorcycle": 1, "van": 1,
        "other": 2, "animal": 1},
    "yield": {"pedestrians": 6, "pedestrian": 6, "car": 5, "truck": 3, "traffic": 3, "van": 2, "bus": 3,
        "vehicle": 3, "vehicles": 2, "bicycle": 3, "motorcycle": 1, "animal": 1},
    "pass": {"car": 6, "truck": 5, "bus": 3, "van": 3, "vehicle": 3, "bicycle": 4, "other": 1, "motorcycle": 2,
        "vehicles": 1, "obstacle": 1, "building": 1},
    "enter": {"roundabout": 5, "lot": 5, "driveway": 4, "road": 3, "lane": 1, "building": 1, "gate": 1},
    "exit": {"roundabout": 4, "lot": 4, "road": 3, "driveway": 1},
    "goto": {"building": 6, "landmark": 5, "road": 1, "other": 1},
    "gap": {"car": 6, "truck": 2, "vehicle": 2, "bus": 1, "van": 1},
}  # fmt: skip
"""Subject of each verb."""
_PLACE_KINDS: Final[Mapping[str, Weights]] = {
    "at": _WAYS, "next": {"junction": 8, "road": 3, "light": 3, "roundabout": 1, "driveway": 1, "crosswalk": 1,
        "stop_sign": 1, "building": 1},
    "into": {"road": 7, "lot": 3, "driveway": 3, "building": 0.5, "parking_space": 1}, "on": {"road": 4,
        "sidewalk": 0.3},
}  # fmt: skip
CONDITIONS: Final[Mapping[str, float]] = {
    "once clear": 18, "once gone": 20, "once passed": 9, "until gone": 6, "once green": 6, "once near": 3,
    "before near": 2, "once stopped": 2, "until green": 2, "once moves": 2, "once opens": 1.5, "until opens": 1,
    "until arrives": 2, "once arrives": 1, "if clear": 3, "while passed": 2, "until told": 2, "once told": 2,
    "if other": 3, "unless clear": 0.5, "until clear": 2, "until passed": 1.5, "once red": 0.5, "if red": 0.7,
    "if stopped": 1, "while gone": 0.7, "once other": 1.5,
}  # fmt: skip
_EVENT_KINDS: Final[Mapping[str, Weights]] = {
    "green": {"light": 1}, "red": {"light": 1},
    "clear": {"": 9, "road": 3, "vehicles": 2, "traffic": 3, "pedestrians": 2, "junction": 1, "lane": 1,
        "crosswalk": 1},
    "gone": {"vehicles": 7, "car": 6, "pedestrians": 4, "pedestrian": 4, "traffic": 2, "motorcycle": 3,
        "truck": 4, "bus": 4, "vehicle": 3, "van": 2, "cone": 0.7, "obstacle": 0.7, "bicycle": 3, "animal": 1},
    "passed": {"junction": 7, "obstacle": 3, "car": 2, "truck": 3, "bus": 2, "building": 2, "light": 2,
        "crosswalk": 1, "landmark": 2, "cone": 1, "van": 1, "sign": 1, "roundabout": 1, "vehicles": 1},
    "near": {"junction": 3, "light": 2, "vehicle": 2, "car": 2, "building": 2, "roundabout": 1, "obstacle": 2,
        "crosswalk": 1, "landmark": 1, "sign": 1},
    "stopped": {"car": 4, "vehicle": 2, "bus": 2, "truck": 2, "traffic": 1, "van": 1},
    "moves": {"car": 5, "vehicle": 2, "truck": 2, "bus": 2, "traffic": 2, "van": 1, "vehicles": 1},
    "opens": {"gate": 1, "barrier": 0.2},
    "arrives": {"pedestrian": 4, "bus": 1, "car": 1},
    "told": {"": 1}, "other": {"": 1},
}  # fmt: skip
_WAITS: Final = frozenset(
    ("turn lane go straight stop avoid keep enter u_turn park pass speed move follow pull_over exit").split()  # noqa: SIM905
)
"""Acts that a condition is said with."""
COLOURS: Final[Weights] = {
    "white": 12, "black": 10, "grey": 5, "red": 8, "yellow": 4, "silver": 4, "orange": 3, "blue": 7, "green": 4,
    "dark": 1, "brown": 1.5, "pink": 1, "purple": 1, "beige": 0.7,
}  # fmt: skip
_PAINTED: Final = frozenset(["car", "truck", "bus", "van", "motorcycle", "bicycle", "vehicle"])
_PEOPLE: Final = frozenset({"pedestrian", "pedestrians"})
_PLURAL: Final = frozenset({"vehicles", "pedestrians"})
_MASS: Final = frozenset({"traffic", "end_of_road", "me_here"})
_NO_DETAIL: Final = frozenset({"traffic", "end_of_road", "me_here", "light", "roundabout"})
_STATES: Final[Mapping[str, Weights]] = {
    "vehicle": {"parked": 6, "moving": 2, "turning": 2, "oncoming": 3, "stopped": 2},
    "people": {"walking": 4, "standing": 3, "crossing": 4},
}
_WAITED: Final[Weights] = {
    "until gone": 8, "until green": 3, "until clear": 4, "until arrives": 3, "until told": 3, "until opens": 1.5,
    "until moves": 1, "until other": 1,
}  # fmt: skip
"""Events that a `wait` waits for."""
_POINTED: Final[Weights] = {
    "stop": 9, "park": 4, "pull_over": 2, "follow": 7, "pass": 2, "avoid": 3, "yield": 4, "turn": 1, "speed": 1,
}  # fmt: skip
"""Acts about what the sentence before pointed at."""
_DENIED: Final[Weights] = {
    "turn": 4, "lane": 3, "stop": 4, "pass": 4, "follow": 2, "speed": 2, "park": 3, "yield": 1.5, "go": 1,
    "pull_over": 1, "enter": 1,
}  # fmt: skip
"""Acts that are told not to be done."""
_IT: Final[Mapping[bool, Weights]] = {
    True: {"him": 4, "her": 3, "them": 2},
    False: {"it": 5, "them": 2, "him": 1.5, "that one": 1},
}
"""Pronouns of people and of vehicles."""
_MOST_CHARS: Final = 300
_SPACE: Final = re.compile(r"\s+")
_SLOT: Final = re.compile(r"\{([a-z_]+)(\??)\}")
_MARK: Final = re.compile(r"<(\d+|n)|(\d+|n)>|#")
_TIGHT: Final = re.compile(r"\s+([,.;:!?])")
_RELATIONS: Final = frozenset(get_args(Relation))


@dataclass(frozen=True, slots=True)
class Composed:
    """A sentence and its meaning.

    Attributes:
        words: Split at white space.
        acts: With the indices of words as pointers.
        address: For whom the words are.
    """

    words: tuple[str, ...]
    acts: tuple[WrittenAct, ...]
    address: Address = "car"

    @property
    def text(self) -> str:
        """The sentence."""
        return " ".join(self.words)


class Composer:
    """Draws meanings and says them in the phrases of a bank."""

    def __init__(self, bank: Bank, rng: np.random.Generator) -> None:
        """Args: the phrases; what every choice is drawn from."""
        self._bank, self._rng = bank, rng
        self._uniforms: list[float] = []
        self._sums: dict[tuple[tuple[str, float], ...], tuple[tuple[str, ...], list[float]]] = {}

    # Drawing ----------------------------------------------------------------------------------------------------------

    def _uniform(self) -> float:
        """A number from [0, 1); they are drawn by the thousand, which is thirty times as fast."""
        if not self._uniforms:
            self._uniforms = self._rng.random(4096).tolist()
        return self._uniforms.pop()

    def _draw(self, weights: Weights) -> str:
        key = tuple(weights.items())
        held = self._sums.get(key)
        if held is None:
            held = self._sums[key] = tuple(weights), list(accumulate(weights.values()))
        names, sums = held
        return names[min(bisect(sums, self._uniform() * sums[-1]), len(names) - 1)]

    def _often(self, share: float) -> bool:
        return self._uniform() < share

    def _say(self, section: str) -> str:
        phrases = self._bank.get(section)
        if phrases is None:
            raise LookupError(section)
        at = min(bisect(phrases.sums, self._uniform()), len(phrases.texts) - 1)
        return chosen(phrases.texts[at], self._uniform)

    def _has(self, section: str) -> bool:
        return self._bank.get(section) is not None

    def sentence(self) -> Composed:
        """One sentence, of an act or more, of none, with or without chat around it."""
        while True:
            try:
                found = self._drawn()
            except LookupError:
                continue  # the writer has no phrase for what was drawn
            if found is not None and len(found.text) <= _MOST_CHARS:
                return found

    def _drawn(self) -> Composed | None:
        kind = self._draw({"acts": 70, "pointed": 9, "chat": 9, "negated": 5, "corrected": 4, "said": 6})
        if kind == "chat":
            return self._chat()
        if kind == "pointed":
            acts, text = self._pointed()
        elif kind == "corrected":
            acts, text = self._corrected()
        elif kind == "negated":
            acts, text = self._negated()
        elif kind == "said":
            act, text = self._act_of(
                self._draw({"speed": 5, "gap": 2, "stop": 1.5, "pull_over": 1, "wait": 0.5, "goto": 0.5, "go": 0.5}),
                "say",
            )
            acts = [act]
            text = self._marked(text, 0)
        else:
            acts, text = self._several()
        return self.finish(self._around(text), acts)

    # References -------------------------------------------------------------------------------------------------------

    def reference(self, kind: str, detail: float = 0.5, depth: int = 0, pointed: float = 0.25) -> tuple[Reference, str]:
        """A reference of a kind and how it is said."""
        if kind == "pedestrian" and depth == 0 and self._often(0.22):
            return self._person()
        ref = Reference(cast("ReferenceKind", kind))
        noun = self._say(f"noun {kind}")
        if noun.startswith("="):  # a whole phrase that takes no article: "home", "the end of the road"
            return ref, noun[1:]
        before: list[str] = []
        after: list[str] = []
        if "@" in noun:  # a name that is copied
            noun = noun.replace("@", "")
            ref, noun = replace(ref, name="?"), f"<n {noun} n>"
        if kind not in _NO_DETAIL and self._often(detail):
            ref = self._detailed(ref, before, after, depth)
        if kind == "traffic" and self._often(0.4):
            ref = replace(ref, state="oncoming")
            before.append(self._say("state oncoming before"))
        plural = kind in _PLURAL or (noun.endswith("s") and not noun.endswith("ss") and noun not in ("bus",))
        if kind not in _MASS and self._often(pointed):
            ref = replace(ref, deictic=True)
            article = self._say("deictic plural" if plural else "deictic")
            article, _, tail = article.partition("...")
            after += [tail] if tail else []
        elif plural or kind == "traffic":
            article = self._draw({"the": 10, "": 3, "all the": 1, "any": 0.6, "some": 0.3})
        else:
            article = self._draw({"the": 10, "a": 1.8, "": 0.4, "my": 0.1})
        said = " ".join((*before, noun, *after))
        if article == "a" and said[:1] in "aeiou":
            article = "an"
        return ref, f"{article} {said}"

    def _detailed(self, ref: Reference, before: list[str], after: list[str], depth: int) -> Reference:
        kind = ref.kind
        family = "vehicle" if kind in _PAINTED or kind == "vehicles" else "people" if kind in _PEOPLE else ""
        if (kind in _PAINTED and self._often(0.55)) or (kind == "building" and self._often(0.1)):
            colour = self._draw(COLOURS)
            ref = replace(ref, colour=cast("Any", colour))
            before.append(self._say(f"colour {colour}"))
        elif kind in _PEOPLE and self._often(0.35):
            colour = self._draw(COLOURS)
            ref = replace(ref, colour=cast("Any", colour))
            after.append(self._say("clothes").replace("{x}", self._say(f"colour {colour}")))
        if family and self._often(0.3):
            state = self._draw(_STATES[family])
            if self._often(0.5) and self._has(f"state {state} before"):
                ref = replace(ref, state=cast("Any", state))
                before.insert(0, self._say(f"state {state} before"))
            elif self._has(f"state {state} after"):
                ref = replace(ref, state=cast("Any", state))
                after.append(self._say(f"state {state} after"))
        if self._often(0.25):
            side = self._draw({"left": 1, "right": 1})
            ref = replace(ref, side=cast("Any", side))
            if self._often(0.2) and kind not in ("lane", "road"):
                before.insert(0, self._say("side before").replace("{side}", side))
            else:
                after.append(self._say("side after").replace("{side}", side))
        elif self._often(0.28):
            where = self._draw({"ahead": 14, "behind": 2, "across": 2.5, "near": 1.5, "far": 1, "beside": 1})
            ref = replace(ref, where=cast("Any", where))
            after.append(self._say(f"where {where}"))
        if self._often(0.1) and kind not in _PLURAL:
            ordinal = int(self._draw({"1": 4, "2": 4, "3": 2, "4": 0.5, "-1": 2}))
            ref = replace(ref, ordinal=ordinal)
            before.insert(0, self._say(f"ordinal {ordinal}"))
        if depth < 1 and self._often(0.12) and self._bank.under(f"of {kind}"):
            section = self._draw(dict.fromkeys(self._bank.under(f"of {kind}"), 1.0))
            other, said = self.reference(section.split()[2], 0.35, depth + 1)
            ref = replace(ref, of=other)
            after.append(self._say(section).replace("{of}", said))
        return ref

    def _person(self) -> tuple[Reference, str]:
        """A person by a pronoun, a name or a relation."""
        way = self._draw({"pronoun": 3, "name": 2, "relation": 2})
        ref = Reference("pedestrian", deictic=way == "pronoun")
        if way == "pronoun":
            return ref, self._draw({"him": 3, "her": 3, "them": 2})
        if way == "relation":
            return ref, self._say("relation")
        return replace(ref, name="?"), f"<n {self._say('name')} n>"

    def _placed(self, verb: str, relation: str = "") -> tuple[ActPlace, str]:
        rel = relation or self._draw(PLACED[verb][1])
        if rel == "here":
            return ActPlace("here"), self._say("place here")
        kinds = _PLACE_KINDS.get(rel, _THINGS)
        if rel == "at" and verb in ("stop", "park", "pull_over", "wait", "speed"):
            kinds = {**_WAYS, "pedestrian": 7, "building": 6, "crosswalk": 6, "gate": 2, "landmark": 2, "other": 2}
        if rel == "before":
            kinds = {**_WAYS, "crosswalk": 10, "car": 2, "pedestrian": 2, "obstacle": 1, "gate": 1, "cone": 1}
        if rel == "into" and verb == "park":
            kinds = {"parking_space": 3, "lot": 3, "driveway": 1}
        ref, said = self.reference(self._draw(kinds), 0.4 if rel in ("at", "next") else 0.55, pointed=0.15)
        if rel == "next":
            noun = self._say(f"noun {ref.kind}").lstrip("=").replace("@", "")
            return ActPlace("next", Reference(ref.kind)), self._say("place next").replace("{n}", noun)
        return ActPlace(cast("Relation", rel), ref), self._say(f"place {rel}").replace("{ref}", said)

    # Acts -------------------------------------------------------------------------------------------------------------

    def _act_of(self, verb: str, form: str = "act") -> tuple[WrittenAct, str]:
        """An act of a verb, and a phrase that says it, without marks around it."""
        names = self._bank.under(f"{form} {verb}")
        if not names:
            raise LookupError(verb)
        sizes = {name: float(len(self._bank.sections[name].texts)) ** 0.7 for name in names}
        section = self._draw(sizes)
        fields = {
            name: value.replace("_", " ") for name, _, value in (part.partition("=") for part in section.split()[2:])
        }
        act = Act(cast("Verb", verb), **cast("Any", fields))
        return self._filled(act, self._say(section))

    def _filled(self, act: Act, phrase: str) -> tuple[WrittenAct, str]:
        """The slots of a phrase filled, and the act with what filled them."""
        valued = False
        for slot in _SLOT.finditer(phrase):
            name, optional = slot[1], bool(slot[2])
            if name in ("a", "b", "x", "who", "n", "they"):
                continue
            share = (
                PLACED.get(act.act, (0.5, {}))[0] if name == "place" else {"manner": 0.12, "side": 0.4}.get(name, 0.5)
            )
            said = ""
            if not optional or self._often(share):
                act, said, number = self._slot(act, name)
                valued |= number
            phrase = phrase.replace(slot[0], said, 1)
        return WrittenAct(act, (0, 0), 0 if valued else None), phrase

    def _slot(self, act: Act, name: str) -> tuple[Act, str, bool]:
        if name == "side":
            side = act.side or self._draw({"left": 1, "right": 1})
            return replace(act, side=cast("Any", side)), side, False
        if name == "to":
            to = act.to or self._draw({"rightmost": 4, "leftmost": 3, "middle": 3})
            return replace(act, to=cast("LaneAim", to)), self._say(f"to {to}"), False
        if name == "manner":
            manner = act.manner or self._draw({"slow": 3, "careful": 3, "quick": 2})
            return replace(act, manner=cast("Manner", manner)), self._say(f"manner {manner}"), False
        if name in ("speed", "gap"):
            return act, f"# {self._amount(name)}", True
        if name == "place":
            place, said = self._placed(act.act)
            return replace(act, place=place), said, False
        if name in _RELATIONS:
            place, said = self._placed(act.act, name)
            return replace(act, place=place), said, False
        if name in ("target", "ref"):
            ref, said = self.reference(self._draw(TARGETS.get(act.act, _THINGS)), 0.5)
            return replace(act, target=ref), said, False
        raise LookupError(name)

    def _whole(self, low: int, high: int) -> int:
        return low + int(self._uniform() * (high - low))

    def _amount(self, name: str) -> str:
        if name == "speed":
            unit = self._draw({"": 4, "kmh": 5, "mph": 5, "mps": 1.5})
            value = 5 * self._whole(2, 27) if unit != "mps" else self._whole(3, 35)
            said = str(value) if self._often(0.75) else in_words(value)
            return f"{said} {self._say(f'unit {unit}')}".strip() if unit else said
        unit = self._draw({"m": 5, "s": 3, "lengths": 3, "ft": 1.5})
        value = self._whole(1, 7) if unit in ("s", "lengths") else 5 * self._whole(1, 16)
        said = str(value) if self._often(0.7) else in_words(value)
        return f"{said} {self._say(f'unit {unit}')}"

    def _conditioned(self, act: WrittenAct, phrase: str) -> tuple[WrittenAct, str]:
        drawn = self._draw(CONDITIONS)
        kind, event = drawn.split()
        said = self._say(f"when {drawn}")
        ref: Reference | None = None
        if "{ref}" in said:
            of = self._draw({k: w for k, w in _EVENT_KINDS[event].items() if k} or {"light": 1.0})
            ref, words = self.reference(of, 0.4, pointed=0.2)
            said = said.replace("{ref}", words)
        held = replace(act, act=replace(act.act, when=Condition(cast("Any", kind), cast("Any", event), ref)))
        if said.startswith(">"):  # "wait for the bus to pass": only in front
            gerund = gerund_of(phrase) if self._often(0.3) else ""
            then = f"before {gerund}" if gerund else f"{self._say('then')} {phrase}"
            return held, f"{said[1:].strip()} {then}"
        if said.startswith("<"):
            return held, f"{phrase} {said[1:].strip()}"
        if self._often(0.5):
            return held, f"{phrase}{self._draw({'': 5, ',': 1})} {said}"
        return held, f"{said}{self._draw({',': 4, '': 2, ', then': 0.5})} {phrase}"

    def _one(self, before: str = "") -> tuple[list[WrittenAct], str]:
        """An act with its condition and purpose, unmarked."""
        weights = dict(VERBS)
        if before:
            for verb in ("refuse", "goto", "wait"):
                weights[verb] *= 0.4
            weights[before] = weights.get(before, 1.0) * 0.4
        verb = self._draw(weights)
        if verb == "wait" and self._often(0.75):
            return self._waiting()
        if verb == "stop" and self._often(0.06):
            return self._both()
        if verb in ("avoid", "yield", "follow") and self._often(0.06):
            return self._pair(verb)
        act, phrase = self._act_of(verb)
        if verb in _WAITS and self._often(0.2):
            act, phrase = self._conditioned(act, phrase)
        elif verb in ("lane", "stop", "speed", "move", "turn", "pull_over", "go") and self._often(0.1):
            aim = self._draw({"avoid": 5, "yield": 2, "pass": 1})
            why, said = self._act_of(aim, "purpose")
            return [act, replace(why, act=replace(why.act, purpose=True))], f"<0 {phrase} 0> <1 {said} 1>"
        return [act], f"<0 {phrase} 0>"

    def _waiting(self) -> tuple[list[WrittenAct], str]:
        """`wait` with what it waits for, alone or after a stop."""
        drawn = self._draw(_WAITED)
        said = self._say(f"wait {drawn}")
        kind, event = drawn.split()
        act = Act("wait")
        ref: Reference | None = None
        if "{ref}" in said:
            ref, words = self.reference(self._draw({k: w for k, w in _EVENT_KINDS[event].items() if k}), 0.4)
            said = said.replace("{ref}", words)
        act = replace(act, when=Condition(cast("Any", kind), cast("Any", event), ref))
        held, said = self._filled(act, said)
        return [held], f"<0 {said} 0>"

    def _both(self) -> tuple[list[WrittenAct], str]:
        """A stop, and in the same words whom it is for."""
        kind = self._draw(dict.fromkeys(self._bank.under("both stop yield"), 1.0))
        phrase = self._say(kind)
        act = Act("stop")
        if "{place}" in phrase:
            place, said = self._placed("stop")
            act, phrase = replace(act, place=place), phrase.replace("{place}", said)
        ref, said = self.reference(self._draw(TARGETS["yield"]))
        why = Act("yield", target=ref, purpose=True)
        head, _, tail = phrase.replace("{target}", said).partition(" for ")
        return [WrittenAct(act, (0, 0)), WrittenAct(why, (0, 0))], f"<0 {head} 0> <1 for {tail} 1>"

    def _pair(self, verb: str) -> tuple[list[WrittenAct], str]:
        """Two things in one breath: "avoid the cones and the truck" is two acts."""
        act, phrase = self._act_of(verb)
        if act.act.target is None or act.value is not None:
            raise LookupError(verb)
        ref, said = self.reference(self._draw(TARGETS[verb]))
        if ref.name or act.names:
            raise LookupError(verb)
        other = Act(cast("Verb", verb), target=ref)
        return [act, WrittenAct(other, (0, 0))], f"<0 {phrase} 0> <1 and {said} 1>"

    def _marked(self, text: str, index: int) -> str:
        return f"<{index} {text} {index}>"

    def _several(self) -> tuple[list[WrittenAct], str]:
        """Acts in their order, joined as people join them."""
        count = int(self._draw({"1": 60, "2": 30, "3": 8, "4": 2}))
        acts, text = self._one()
        for _ in range(count - 1):
            more, said = self._one(acts[-1].act.act)
            said = _shifted(said, len(acts))
            join = self._say("join")
            head, _, rest = said.partition(" ")
            gerund = gerund_of(rest) if self._often(0.06) else ""
            if gerund:
                text = f"{text} before {head} {gerund}"
            elif "{b}" in join:
                text = (join if "{a}" in join else f"{{a}} {join}").replace("{a}", text).replace("{b}", said)
            else:
                text = f"{text}{'' if join[0] in ',.;' else ' '}{join} {said}"
            acts = [*acts, *more]
        return acts, text

    # What is not an act -----------------------------------------------------------------------------------------------

    def _chat(self) -> Composed | None:
        """Words that ask nothing of the car: remarks, stories, questions, feedback, words to others."""
        address = self._draw({"remark": 5, "story": 4, "question": 4, "feedback": 2, "other": 2})
        text = self._say(f"chat {address}")
        if "{a}" in text:
            _, said = self._act_of(self._draw(VERBS))
            text = text.replace("{a}", said)
        while "{ref}" in text:
            text = text.replace("{ref}", self.reference(self._draw(_THINGS), 0.5)[1], 1)
        text = _MARK.sub(" ", text)
        return replace(cast("Composed", self.finish(text, [])), address=cast("Address", address))

    def _pointed(self) -> tuple[list[WrittenAct], str]:
        """A sentence that points at something, and one that uses it by a pronoun."""
        kind = self._draw({"pedestrian": 9, "car": 5, "truck": 2, "van": 2, "bus": 1, "bicycle": 1, "motorcycle": 1})
        ref, said = self.reference(kind, 0.6, depth=1, pointed=0.0)
        if kind == "pedestrian":
            who = self._draw({"relation": 4, "name": 3, "both": 2, "plain": 1})
            if who != "plain":
                name = f"<n {self._say('name')} n>"
                said = {"relation": self._say("relation"), "name": name, "both": f"{self._say('relation')} {name}"}[who]
                ref = Reference("pedestrian", name="" if who == "relation" else "?")
                extra: list[str] = []
                if self._often(0.5):
                    ref = self._detailed(ref, [], extra, 1) if self._often(0.5) else ref
                    if (
                        (ref.state and not extra)
                        or (ref.colour and not extra)
                        or (ref.side and not extra)
                        or ref.ordinal
                    ):
                        ref = Reference("pedestrian", name=ref.name)
                        extra = []
                said = " ".join((said, *extra))
        ref = replace(ref, deictic=True)
        opened = self._say(f"point {'pedestrian' if kind == 'pedestrian' else 'vehicle'}").replace("{who}", said)
        verb = self._draw(_POINTED)
        if kind == "pedestrian" and verb in ("follow", "pass"):
            verb = "stop"
        if kind != "pedestrian" and verb == "turn":
            verb = "follow"
        it = self._draw(_IT[kind == "pedestrian"])
        form = f"pronoun {verb}" if self._has(f"pronoun {verb}") else ""
        if form:
            phrase, act = self._say(form), Act(cast("Verb", verb))
            rel = re.match(r"(\w+):", phrase)
            if rel is not None and rel[1] in _RELATIONS:
                act = replace(act, place=ActPlace(cast("Relation", rel[1]), ref))
                phrase = phrase[rel.end() :].strip()
            else:
                act = replace(act, target=ref)
            if verb == "speed":
                act = replace(act, direction=cast("Direction", "slower"))
            held, phrase = self._filled(act, phrase.replace("{x}", it))
        else:
            raise LookupError(verb)
        # A name was said in the first sentence: its pointer goes there.
        return [
            held
        ], f"{opened}{self._draw({'.': 6, ',': 4, '': 1, '!': 1, ' so': 1, ' and': 0.7, ';': 0.5})} <0 {phrase} 0>"

    def _corrected(self) -> tuple[list[WrittenAct], str]:
        """Something said and taken back; what is said last counts."""
        verb = self._draw({"turn": 5, "lane": 4, "speed": 3, "stop": 2, "park": 2, "pull_over": 1, "goto": 1})
        first, said = self._act_of(verb)
        act, phrase = self._act_of(verb if self._often(0.7) else self._draw(VERBS))
        if first.act.side and act.act.side == first.act.side:
            raise LookupError("the same side")
        text = self._say("correction").replace("{x}", _MARK.sub(" ", said)).replace("{a}", f"<0 {phrase} 0>")
        return [act], text

    def _negated(self) -> tuple[list[WrittenAct], str]:
        """An act that is not to be done, alone or beside one that is."""
        verb = self._draw(_DENIED)
        act, phrase = self._act_of(verb)
        text = self._say("negation").replace("{a}", phrase)
        acts = [replace(act, act=replace(act.act, negated=True))]
        if "{b}" in text:
            more, said = self._act_of(self._draw(VERBS))
            if text.index("{b}") < text.index(phrase[:5] or " "):
                acts, text = [more, *acts], text.replace("{b}", f"<0 {said} 0>")
                head, _, tail = text.partition("0>")
                return acts, f"{head}0> <1 {tail} 1>"
            head, _, tail = text.partition("{b}")
            return [*acts, more], f"<0 {head} 0> <1 {said} 1>{tail}"
        return acts, f"<0 {text} 0>"

    def _around(self, text: str) -> str:
        """A frame, chat before or behind, as people talk."""
        if self._often(0.35):
            frame = self._say("frame")
            text = frame.replace("{a}", text)
        if self._often(0.07):
            text = f"{self._say('lead')}{self._draw({'.': 5, ',': 3, '': 1, ' so': 1})} {text}"
        elif self._often(0.08):
            text = f"{text}{self._draw({'.': 4, ',': 3, '': 2})} {self._say('tail')}"
        return text

    # Finishing --------------------------------------------------------------------------------------------------------

    def finish(self, text: str, acts: list[WrittenAct]) -> Composed | None:
        """The marks taken out, and their places as indices of words."""
        text = _TIGHT.sub(r"\1", _SPACE.sub(" ", text)).strip()
        words: list[str] = []
        opened: dict[str, int] = {}
        spans: dict[int, tuple[int, int]] = {}
        names: list[tuple[int, int]] = []
        numbers: list[int] = []
        for part in text.replace("<", " <").split():
            tail = part.lstrip("0123456789n>") if re.match(r"(\d+|n)>", part) else ""
            mark = _MARK.fullmatch(part.removesuffix(tail) if tail else part)
            if mark is None:
                words.append(part)
                continue
            if mark[1]:
                opened[mark[1]] = len(words)
            elif mark[2] == "n":
                names.append((opened["n"], len(words) - 1))
            elif mark[2]:
                spans[int(mark[2])] = (opened[mark[2]], len(words) - 1)
            else:
                numbers.append(len(words))
            if tail and words:
                words[-1] += tail
        if any(low > high for low, high in spans.values()) or len(spans) != len(acts):
            return None
        done: list[WrittenAct] = []
        for index, one in enumerate(acts):
            low, high = spans[index]
            inside = [number for number in numbers if low <= number <= high]
            asked = sum(_names(ref) for ref in _references(one.act))
            own = [name for name in names if low <= name[0] <= high] or names
            if asked > len(own) or (one.value is not None and len(inside) != 1):
                return None
            done.append(
                WrittenAct(one.act, (low, high), inside[0] if one.value is not None else None, tuple(own[:asked]))
            )
        return Composed(tuple(words), tuple(done))


def _references(act: Act) -> list[Reference]:
    held = (act.target, act.place.ref if act.place else None, act.when.ref if act.when else None)
    return [one for one in held if one is not None]


def _names(ref: Reference | None) -> int:
    return 0 if ref is None else bool(ref.name) + _names(ref.of)


def _shifted(text: str, by: int) -> str:
    """Marks of acts counted on."""
    text = re.sub(r"<(\d+) ", lambda found: f"<{int(found[1]) + by} ", text)
    return re.sub(r" (\d+)>", lambda found: f" {int(found[1]) + by}>", text)


_DOUBLED: Final = frozenset(
    ("stop get let drop hit swap cut set put hop slip spin sit run flip skip bus jam rip tip").split()  # noqa: SIM905
)
_GERUNDS: Final = {"make": "making", "take": "taking", "u-turn": "making a u-turn", "lie": "lying", "be": "being"}
_OPENERS_WORDS: Final = (
    "turn take make stop pull come park find follow stay keep avoid go drive steer swerve get move let yield "
    "give allow pass overtake wait remain continue proceed head change switch merge shift slide cross slow "
    "reduce decelerate speed accelerate increase enter leave exit drop pick hold brake set start begin"
)
_OPENERS: Final = frozenset(_OPENERS_WORDS.split())
"""Verbs whose gerund is made; a phrase that opens with another word has none."""


def gerund_of(phrase: str) -> str:
    """`turn left` -> `turning left`; empty where a phrase does not begin with a plain verb."""
    verb, _, rest = phrase.strip().partition(" ")
    if verb not in _OPENERS:
        return ""
    made = _GERUNDS.get(verb) or (
        f"{verb}{verb[-1]}ing" if verb in _DOUBLED else f"{verb[:-1]}ing" if verb.endswith("e") else f"{verb}ing"
    )
    return f"{made} {rest}".strip()


def in_words(value: int) -> str:
    """A whole number up to 199 in words."""
    if value >= 100:
        rest = value - 100
        return "a hundred" if rest == 0 else f"a hundred and {in_words(rest)}"
    if value < 20:
        return ONES[value]
    ten, one = divmod(value, 10)
    return TENS[ten - 2] if one == 0 else f"{TENS[ten - 2]}{' ' if value % 2 else '-'}{ONES[one]}"
