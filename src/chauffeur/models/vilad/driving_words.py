"""Commands of short drives in words: turn, halt, where, how far and how fast, composed from a bank of phrases."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from chauffeur.models.vilad.parking_words import BANK as PARKING
from chauffeur.models.vilad.phrases import OPENERS, PhraseBank, Split, held_back, novel, pick, sentence, worn
from chauffeur.planners.vilad.driving import MARKS, METRES, NONE, NOTHING

_JOINS: Final = (" and ", " and ", ", ", ", and ", " and then ", ", then ")
_NUMBERS: Final[Mapping[str, str]] = {"10": "ten", "15": "fifteen", "20": "twenty", "25": "twenty-five", "30": "thirty"}
BANK: Final = PhraseBank("driving.txt", (*_JOINS, *_NUMBERS.values(), "five"), PARKING)


@dataclass(frozen=True, slots=True)
class DriveCommand:
    """A command and what it asks for.

    Attributes:
        text: The words.
        asked: A value for each of the template's criteria.
    """

    text: str
    asked: Mapping[str, str]


def _draw_asked(rng: np.random.Generator) -> dict[str, str]:
    asked = dict(NOTHING)
    if rng.random() < 0.6:
        asked["turn"] = ("left", "right", "straight")[int(rng.choice(3, p=(0.37, 0.37, 0.26)))]
    if asked["turn"] == NONE or rng.random() < 0.8:
        asked["halt"] = "kerb" if rng.random() < 0.35 else "stop"
    if asked["halt"] != NONE:
        about = rng.random()
        if about < 0.72:
            asked["mark"] = MARKS[int(rng.integers(len(MARKS)))]
            beside = asked["mark"] in ("cones", "vehicle") and asked["halt"] == "stop"
            places = ("before", "after", "beside") if beside else ("before", "after")
            if asked["mark"] == "junction" and asked["turn"] in ("left", "right"):
                places = ("after",)
            asked["place"] = places[int(rng.integers(len(places)))]
        elif about < 0.86:
            asked["metres"] = METRES[int(rng.integers(len(METRES)))]
    if rng.random() < 0.35:
        asked["pace"] = ("slow", "brisk")[int(rng.integers(2))]
    return asked


def drive_command(rng: np.random.Generator, split: Split) -> DriveCommand:
    """One command of a split."""
    while True:
        asked = _draw_asked(rng)
        if split in ("train", "fit", "tune", "seen") and held_back(asked, NOTHING):
            continue
        if split == "composition" and not held_back(asked, NOTHING):
            continue
        text = _said(rng, asked, split)
        if split != "vocabulary" or BANK.unheard(text):
            return DriveCommand(text, asked)


def _said(rng: np.random.Generator, asked: Mapping[str, str], split: Split) -> str:
    around: Split = "phrasing" if split in ("phrasing", "vocabulary") else "train"
    there = [asked["turn"] != NONE, asked["halt"] != NONE, asked["mark"] != NONE, asked["metres"] != NONE]
    parts = novel(rng, sum(there) + (asked["pace"] != NONE), split)
    turn, halt, where = _main(rng, asked, parts)
    own = parts[-1]
    before: list[str] = []
    after: list[str] = []
    how = ""
    if asked["pace"] != NONE:
        if rng.random() < 0.5:
            how = " " + pick(rng, _said_by(asked["pace"], "a", own))
        else:
            (before if rng.random() < 0.4 else after).append(pick(rng, _said_by(asked["pace"], "s", own)))
    if rng.random() < 0.1:
        (before if rng.random() < 0.6 else after).append(pick(rng, BANK.phrases("chatter", "s", around)))
    return worn(rng, " ".join((*before, _told(rng, (turn, halt, where, how)), *after)))


def _said_by(section: str, kind: str, split: Split) -> tuple[str, ...]:
    """Phrases of a section; of another kind's split where this one has none in new words."""
    return BANK.phrases(section, kind, split) or BANK.phrases(section, kind, "phrasing")


def _main(rng: np.random.Generator, asked: Mapping[str, str], parts: list[Split]) -> tuple[str, str, str]:
    """(clause of the turn, of the halt, where to halt); empty for what is not asked."""
    turn = halt = where = ""
    own = iter(parts)
    if asked["turn"] != NONE:
        split = next(own)
        halts = asked["halt"] != NONE and rng.random() < 0.2
        turn = pick(rng, _said_by(asked["turn"], "t" if halts else "c", split))
        turn = f"<{turn}" if halts else turn
    if asked["halt"] != NONE:
        halt = pick(rng, _said_by(asked["halt"], "c", next(own)))
    if asked["mark"] != NONE:
        split = next(own)
        section = asked["place"] + (".vehicle" if asked["mark"] == "vehicle" and asked["place"] != "beside" else "")
        how, what = _places(rng, split)
        text = pick(rng, _said_by(section, "p", how))
        where = text.replace("{L}", pick(rng, _said_by(asked["mark"], "n", what)))
    elif asked["metres"] != NONE:
        number = asked["metres"] if rng.random() < 0.7 else _NUMBERS[asked["metres"]]
        where = pick(rng, _said_by("metres", "p", next(own))).replace("{N}", number)
    return turn, halt, where


def _places(rng: np.random.Generator, split: Split) -> tuple[Split, Split]:
    """Which splits the words around a mark and its name come from: new ones around it, a new name, or both."""
    if split not in ("phrasing", "vocabulary"):
        return split, split
    other: tuple[Split, Split] = ("train", "phrasing") if split == "phrasing" else ("phrasing", "phrasing")
    kind = int(rng.integers(3))
    return (
        (split, other[0])
        if kind == 0
        else (other[1 if split == "vocabulary" else 0], split)
        if kind == 1
        else (split, split)
    )


def _told(rng: np.random.Generator, own: tuple[str, str, str, str]) -> str:
    """The main sentence."""
    turn, halt, where, how = own
    opener = pick(rng, OPENERS)
    if not halt:
        return sentence(opener + turn + how) + "."
    placed = f"{halt} {where}" if where else halt
    if where and rng.random() < 0.12:
        placed = f"{where}, {halt}"
    if turn.startswith("<"):  # "after turning left"
        turned = turn[1:]
        text = f"{turned}, {placed}" if rng.random() < 0.4 else f"{placed} {turned}"
        return sentence(opener + text + how) + "."
    if not turn:
        return sentence(opener + placed + how) + "."
    if how and rng.random() < 0.5:
        return sentence(opener + turn + how + pick(rng, _JOINS) + placed) + "."
    if rng.random() < 0.12:
        return sentence(opener + turn) + ". " + sentence(placed + how) + "."
    return sentence(opener + turn + pick(rng, _JOINS) + placed + how) + "."
