"""Wishes on a motorway with their acts: the tables of `data/onboard` and `data/sorters`, said as acts.

A skill of the driving dialect is drawn, said in a wording of its table, and labelled with the acts that the skill
stands for (`planners.meaning.dialect_acts`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Final

import numpy as np

from chauffeur.concept.data import data_folder
from chauffeur.language.meaning.symbols import WrittenAct
from chauffeur.models.meaning.composer import Composed
from chauffeur.models.meaning.labelled import act_of, line_of
from chauffeur.models.onboard.cases import WEIGHTS
from chauffeur.models.onboard.speech import Unit, spoken
from chauffeur.models.onboard.wordings import beside, clause, conditioned, in_order, levels, utter
from chauffeur.planners.meaning.dialect_acts import AHEAD, CONDITION_ACTS, MANNER_ACTS, REMARK_ACTS, SKILL_ACTS
from chauffeur.planners.onboard.dialect import CONDITIONS, SKILLS, Kind

_LEVELS: Final = (0.5, 0.3, 0.2)
"""Shares of wishes outright, of complaints, and of mere reasons."""
_KINDS: Final[Mapping[str, float]] = {"one": 48, "manner": 5, "several": 14, "when": 14, "again": 4, "asked": 4,
    "refused": 5, "remark": 6}  # fmt: skip
_RANGES: Final[Mapping[Kind, tuple[tuple[Unit, int, int], ...]]] = {
    "speed": (("mph", 5, 90), ("kmh", 5, 140), ("mps", 2, 38), ("", 5, 120)),
    "distance": (("m", 3, 90), ("ft", 10, 250), ("yd", 5, 90), ("car lengths", 2, 9)),
    "time": (("s", 1, 5),),
    "factor": (("times", 1, 1),),
    "lanes": (("lanes", 2, 3),),
}
_FACTORS: Final = (0.25, 0.5, 0.75, 1.5, 2.0, 3.0)
_SLOTS: Final[Mapping[Kind, str]] = {"speed": "v", "distance": "d", "time": "t", "factor": "k", "lanes": "k"}
_ASKED: Final[Mapping[str, str]] = {
    "ask.turn": "turn", "ask.gap_amount": "gap", "ask.gap_change": "gap", "ask.change": "speed",
    "ask.what": "unclear", "ask.again": "unclear", "ask.contradiction": "unclear",
}  # fmt: skip
_REFUSED: Final[Mapping[str, str]] = {
    "refuse.offtopic": "refuse why:not_driving", "refuse.unsafe_speed": "refuse why:dangerous",
    "refuse.unsafe_gap": "refuse why:dangerous", "refuse.ram": "refuse why:dangerous",
    "refuse.reverse": "refuse why:dangerous", "refuse.wrong_way": "refuse why:illegal",
    "refuse.hostile": "refuse why:dangerous", "refuse.question": "U:question",
}  # fmt: skip
_SORTED: Final[Mapping[str, str]] = {
    "highway/faster/I": "speed direction:faster", "highway/slower/I": "speed direction:slower",
    "highway/right/I": "lane side:right", "highway/pass/I": f"pass {AHEAD}", "crossing/go/I": "go",
    "crossing/yield/I": "yield T K:vehicles", "lot/faster/I": "speed direction:faster",
    "lot/slower/I": "speed direction:slower", "lot/park.nearest/I": "park aim:nearest",
    "highway/none": "U:remark", "crossing/none": "U:remark", "lot/none": "U:remark",
}  # fmt: skip
"""Outright wishes of `data/sorters/wishes.tsv`: a hint is an act only where its world is known."""
_TOWN: Final[Mapping[str, str]] = {
    "faster": "speed direction:faster", "slower": "speed direction:slower", "uturn": "u_turn",
    "calm": "speed direction:slower style:relaxed", "hurry": "speed direction:faster style:hurry",
    "question": "U:question", "none": "U:remark",
}  # fmt: skip


_LEADS: Final = (
    ("truck", re.compile(r"\b(?:truck|lorry|artic|hgv|semi|tanker|wagon|low loader|juggernaut|tipper)s?\b", re.I)),
    ("bus", re.compile(r"\b(?:bus|coach|minibus)\b", re.I)),
    ("van", re.compile(r"\b(?:van|camper|motorhome)\b", re.I)),
    ("motorcycle", re.compile(r"\b(?:motorbike|motorcycle|scooter|biker)\b", re.I)),
    ("car", re.compile(r"\b(?:car|estate|hatchback|saloon|suv|taxi|jeep|pickup|sedan|skoda|fiat)\b(?! length)", re.I)),
    ("vehicle", re.compile(r"\b(?:vehicle|traffic|tractor|leader|guy|chap|bloke|fell?a|driver|lady|woman|man|motor|one|"
                           r"him|her|them|person|slowcoach|whoever|whatever)\b", re.I)),
)  # fmt: skip
"""Words for the lead vehicle, the most telling first."""
_AHEAD: Final = re.compile(r"\b(?:ahead|in front|up front|before us|leading|lead)\b", re.I)
_THAT: Final = re.compile(r"\b(?:that|this|him|her)\b", re.I)


def lead_of(words: str) -> str:
    """The target that words about the lead vehicle name; empty where they name none."""
    kind = next((kind for kind, pattern in _LEADS if pattern.search(words)), "")
    if not kind:
        return ""
    return f"T K:{kind}{' where:ahead' * bool(_AHEAD.search(words))}{' DEICTIC' * bool(_THAT.search(words))}"


class HighwaySentences:
    """Draws wishes and says them."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Args: what every choice is drawn from."""
        self._rng = rng
        self._names = list(WEIGHTS)
        share = np.array([WEIGHTS[name] for name in self._names]) ** 0.7  # rare skills are to be learned as well
        self._shares = share / share.sum()

    def _pick(self, choices: Sequence[str]) -> str:
        return choices[int(self._rng.integers(len(choices)))]

    def sentence(self) -> Composed:
        """One sentence."""
        kinds = list(_KINDS)
        shares = np.array([_KINDS[kind] for kind in kinds])
        while True:
            found = self._drawn(kinds[int(self._rng.choice(len(kinds), p=shares / shares.sum()))])
            if found is not None and len(found.text) <= 280:
                return found

    def _drawn(self, kind: str) -> Composed | None:
        match kind:
            case "again":
                section = self._pick(("correction.same", "correction.less", "correction.more"))
                acts = {"same": "again", "less": "again direction:less", "more": "again direction:more"}
                return line_of(utter(section, {}, self._rng).text, acts[section.partition(".")[2]])
            case "asked":
                section = self._pick(list(_ASKED))
                return line_of(utter(section, {"n": "5"}, self._rng).text, _ASKED[section])
            case "refused":
                section = self._pick(list(_REFUSED))
                slots = {"v": "300 km/h", "d": "2 feet", "t": "0.2 seconds", "k": "five times", "n": "90"}
                return line_of(utter(section, slots, self._rng).text, _REFUSED[section])
            case "remark":
                text, label = self._pick_sorted()
                return line_of(text, label)
            case "one":
                return self._single()
            case "manner":
                name = self._pick(("slower", "faster", "lane_left", "lane_right", "overtake_left", "overtake_right",
                    "pull_over", "turn_left", "turn_right", "go_straight", "stop_here"))  # fmt: skip
                how = self._pick(("gently", "quickly"))
                words = f"{clause(name, {}, self._rng).text} {utter(f'manner.{how}', {}, self._rng).text}"
                return self._whole([(words, name, None, MANNER_ACTS[how])], words)
            case "several":
                parts = [self._part() for _ in range(2 if self._rng.random() < 0.8 else 3)]
                return self._whole(parts, in_order([part[0] for part in parts], self._rng).text)
            case _:
                return self._conditioned()

    def _pick_sorted(self) -> tuple[str, str]:
        rows = sorted_rows()
        return rows[int(self._rng.integers(len(rows)))]

    def _skill(self) -> str:
        return self._names[int(self._rng.choice(len(self._names), p=self._shares))]

    def _amount(self, takes: Kind) -> str:
        if takes == "factor":
            return spoken(_FACTORS[int(self._rng.integers(len(_FACTORS)))], "times", self._rng)
        unit, low, high = _RANGES[takes][int(self._rng.integers(len(_RANGES[takes])))]
        value = float(self._rng.integers(low, high + 1))
        value = 5.0 * round(value / 5.0) if value > 20 and self._rng.random() < 0.7 else value
        return spoken(value, unit, self._rng)

    def _slots(self, takes: Kind | None) -> tuple[dict[str, str], str | None]:
        """What the number's slot says, and its text."""
        if takes is None:
            return {}, None
        said = self._amount(takes)
        return {_SLOTS[takes]: said}, said

    def _part(self) -> tuple[str, str, str | None, str]:
        """(imperative, skill, number as said, further symbols)."""
        while True:
            name = self._skill()
            if "style" in SKILL_ACTS[name] or name in ("carry_on", "follow"):
                continue
            slots, said = self._slots(SKILLS[name].takes)
            return clause(name, slots, self._rng).text, name, said, ""

    def _single(self) -> Composed | None:
        name = self._skill()
        known = levels(name)
        section = known[min(int(self._rng.choice(3, p=_LEVELS)), len(known) - 1)]
        slots, said = self._slots(SKILLS[name].takes)
        words = utter(section, slots, self._rng).text
        if said is not None and said.lower() not in words.lower():
            said = None
        if said is None and "VALUE" in SKILL_ACTS[name]:
            return None
        text = beside(words, self._rng) if self._rng.random() < 0.08 and len(words) < 140 else words
        return self._whole([(words.rstrip(".!?"), name, said, "")], text)

    def _conditioned(self) -> Composed | None:
        words, name, said, _ = self._part()
        if "W:" in SKILL_ACTS[name] or "+" in SKILL_ACTS[name]:
            return None
        how = self._pick(("if", "once"))
        if self._rng.random() < 0.35:
            time = spoken(float(self._rng.integers(3, 31)), "s", self._rng)
            when, extra, number = utter("wait", {"t": time}, self._rng).text, "W:once E:time CVALUE", time
        else:
            side = "left" if "left" in name else "right" if "right" in name else ""
            condition = f"clear_{side}" if side and self._rng.random() < 0.6 else self._pick(
                ("lead_slower_than", "lead_closer_than", "lead_further_than"))  # fmt: skip
            takes = CONDITIONS[condition][0]
            slots, number = self._slots(takes)
            when = utter(f"{how}.{condition}", slots, self._rng).text
            extra = f"W:{how} {CONDITION_ACTS[condition]}"
        return self._whole(
            [(words, name, said, extra)], conditioned(when, words, self._rng).text, whole=True, event=number
        )

    def _whole(
        self,
        parts: Sequence[tuple[str, str, str | None, str]],
        text: str,
        *,
        whole: bool = False,
        event: str | None = None,
    ) -> Composed | None:
        """A text with the acts of its parts, each with the words it was made of; `whole` gives it all of them."""
        words = text.split()
        ends = np.cumsum([len(word) + 1 for word in words])
        joined = " ".join(words)
        acts: list[WrittenAct] = []
        at = 0
        for said_words, name, said, extra in parts:
            begin = joined.lower().find(" ".join(said_words.split()).lower(), at)
            if begin < 0:
                low, high, begin = 0, len(words) - 1, 0
            else:
                at = begin + len(said_words)
                low, high = self._word(ends, begin), self._word(ends, at - 1)
            if whole:
                low, high = 0, len(words) - 1
            value = None
            if said is not None:
                found = joined.lower().find(said.lower(), begin)
                found = joined.lower().find(said.lower()) if found < 0 else found
                if found < 0:
                    return None
                value = self._word(ends, found)
            event_value = None
            if event is not None:
                found = joined.lower().find(event.lower())
                if found < 0:
                    return None
                event_value = self._word(ends, found)
            for index, label in enumerate(SKILL_ACTS[name].replace(AHEAD, lead_of(said_words)).split(" + ")):
                act, valued, _ = act_of(f"{label} {extra}" if index == 0 else label)
                if valued and value is None:
                    return None
                acts.append(WrittenAct(act, (low, high), value if valued else None, (), event_value))
        return Composed(tuple(words), tuple(acts))

    def _word(self, ends: np.ndarray, char: int) -> int:
        return int(min(np.searchsorted(ends, char, side="right"), len(ends) - 1))


@cache
def sorted_rows() -> tuple[tuple[str, str], ...]:
    """(text, label) of the sorters' tables whose label says the acts whole."""
    folder = data_folder("sorters")
    found: list[tuple[str, str]] = []
    for name, labels in (("wishes", _SORTED), ("town", _TOWN)):
        for line in (folder / f"{name}.tsv").read_text(encoding="utf-8").splitlines():
            label, text, *_ = line.split("\t")
            if label in labels:
                found.append((text, labels[label].replace(AHEAD, lead_of(text))))
    for line in (folder / "remarks.tsv").read_text(encoding="utf-8").splitlines():
        label, text, *_ = line.split("\t")
        if label in REMARK_ACTS:
            said = REMARK_ACTS[label].replace(AHEAD, lead_of(text))
            found.append((text, f"U:feedback {said}".strip() if label != "none" else "U:remark"))
    return tuple(found)
