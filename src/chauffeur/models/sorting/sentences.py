"""The sentences the sorters learn from, and which kinds each could have been taken for.

Tables in `data/sorters`, one sentence a line: label, sentence, writer, parted by tabs. A label of `wishes.tsv` is a
world, what is wished for and how directly (I asks, II remarks on the road, III only hints; `highway/pass/II`); one of
`remarks.tsv` what the drive was blamed or praised for, and how strongly (`too_fast/bit`); one of `town.tsv` what a
passenger in a town is after; one of `weather.tsv` what a sentence of `wishes.tsv` says of the weather or the road, or
that it says nothing of them though its words look so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept import DataError
from chauffeur.concept.data import read_data
from chauffeur.language.weather import SAID_WEATHERS
from chauffeur.memory.remarks import REMARK_KINDS
from chauffeur.planners.onboard.town_intents import TOWN_INTENTS
from chauffeur.planners.talk2drive.hints import HINT_KINDS

Name = Literal["wishes", "remarks", "town", "weather"]

_WORLDS: Final[Mapping[str, str]] = {"highway": "highway", "crossing": "intersection", "lot": "parking"}
_MOODS: Final[Mapping[tuple[str, str], str]] = {
    ("highway", "pass"): "hurry",
    ("highway", "stay"): "calm",
    ("highway", "right"): "calm",
    ("crossing", "go"): "hurry",
    ("crossing", "yield"): "calm",
}
"""What a bare hint (level III) says outside a lot: how somebody is, not what is to be done about it."""


@dataclass(frozen=True, slots=True)
class Sentence:
    """One line.

    Attributes:
        text: What is said.
        kind: What it says, as the sorter names it.
        among: What it could have been, in the world it was said in.
        writer: Whose it is.
        label: As it stands in the table.
    """

    text: str
    kind: str
    among: tuple[str, ...]
    writer: str
    label: str


def table(name: Name) -> bytes:
    """Content of a table. Raises DataError where it cannot be read."""
    return read_data("sorters", f"{name}.tsv")


def sentences(name: Name) -> tuple[Sentence, ...]:
    """All sentences of a table, in its order.

    Raises:
        DataError: The table cannot be read, or a line is none of its.
    """
    text = table(name).decode("utf-8")
    return tuple(_sentence(name, number, line) for number, line in enumerate(text.splitlines(), start=1))


def kinds_of(name: Name) -> Sequence[str]:
    """Classes of a sorter, in the order of its numbers."""
    if name == "remarks":
        return REMARK_KINDS
    if name == "town":
        return TOWN_INTENTS
    if name == "weather":
        return SAID_WEATHERS
    return tuple(dict.fromkeys(kind for each in HINT_KINDS.values() for kind in each))


def _sentence(name: Name, number: int, line: str) -> Sentence:
    label, _, rest = line.partition("\t")
    text, _, writer = rest.partition("\t")
    kind, among = _wish(label) if name == "wishes" else (label, tuple(kinds_of(name)))
    if not text or not writer or kind not in among:
        raise DataError(f"Line {number} of {name}.tsv is no sentence with its label and writer: {line[:80]!r}.")
    return Sentence(text, kind, among, writer, label)


def _wish(label: str) -> tuple[str, tuple[str, ...]]:
    place, _, wished = label.partition("/")
    kind, _, level = wished.partition("/")
    if level == "III":
        kind = _MOODS.get((place, kind), kind)
    return kind, HINT_KINDS.get(_WORLDS.get(place, ""), ())
