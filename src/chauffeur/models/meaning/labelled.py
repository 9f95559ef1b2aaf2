"""Sentences that writers labelled themselves: whole turns as they would be said, each with its acts in place.

A line of `data/meaning/written/NAME.txt` is a turn; words that ask for one act stand in `[words|label]`:

    [turn left at the lights|turn side:left P:at K:light] and [follow <dad|follow T K:car NAME]'s> car

`<...>` is a name that is copied, `#` stands before a number, ` |U:remark` at the end says for whom words are. Labels
are verbs and the symbols of `language.meaning.symbols`, `VALUE` and `CVALUE` (of a condition) without pointers.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, Final, cast

import numpy as np

from chauffeur.concept import DataError
from chauffeur.concept.data import data_folder
from chauffeur.concept.utterance import (
    Act,
    ActPlace,
    Address,
    Condition,
    Reference,
    Verb,
    reference_from_json,
)
from chauffeur.language.meaning.symbols import WrittenAct
from chauffeur.models.meaning.composer import COLOURS, Composed

_BRACKET: Final = re.compile(r"\[([^\[\]|]*)\|([^\[\]|]*)\]")
_ADDRESS: Final = re.compile(r"\s\|U:(\w+)\s*$")
_MARKS: Final = re.compile(r"(@\d+\(|\)@|<|>|#)")
_PAINTS: Final = ("white", "black", "grey", "red", "yellow", "silver", "orange", "blue", "green")
"""Colours that are exchanged for each other."""
_SWAPPED: Final = {"left": "right", "right": "left"}


def act_of(label: str) -> tuple[Act, bool, bool]:
    """The act of a label, whether it has a value, and whether its condition has one.

    Raises:
        DataError: Not a label.
    """
    verb, *parts = label.split()
    act = Act(cast("Verb", verb))
    valued = event_valued = False
    held: list[tuple[str, list[dict[str, Any]]]] = []
    for part in parts:
        name, _, value = part.partition(":")
        inside = held[-1][1] if held else []
        if part == "VALUE":
            valued = True
        elif part == "CVALUE":
            event_valued = True
        elif part in ("NOT", "PURPOSE"):
            act = replace(act, **{"negated" if part == "NOT" else "purpose": True})
        elif part == "T" or name in ("P", "W"):
            held.append((part, []))
        elif name == "E":
            held[-1] = (f"{held[-1][0]}/{value}", [])
        elif part == "OF":
            continue
        elif name == "K":
            inside.append({"kind": value})
        elif inside and (name in ("colour", "state", "side", "where", "ordinal") or part in ("DEICTIC", "NAME")):
            key = {"DEICTIC": "deictic", "NAME": "name"}.get(part, name)
            inside[-1][key] = {"DEICTIC": True, "NAME": "?"}.get(part) or (int(value) if name == "ordinal" else value)
        elif name in ("manner", "side", "to", "direction", "measure", "degree", "aim", "style", "why"):
            act = replace(act, **{name: value.replace("_", " ") if name in ("to", "why") else value})
        else:
            raise DataError(f"{part!r} may not stand in the label {label!r}.")
    for opened, references in held:
        name, _, rest = opened.partition(":")
        reference = _nested(references)
        if name == "T":
            act = replace(act, target=reference)
        elif name == "P":
            act = replace(act, place=ActPlace(cast("Any", rest), reference))
        else:
            kind, event = rest.split("/")
            act = replace(act, when=Condition(cast("Any", kind), cast("Any", event), reference))
    return act, valued, event_valued


def _nested(references: Sequence[dict[str, Any]]) -> Reference | None:
    found: dict[str, Any] | None = None
    for one in reversed(references):
        found = one if found is None else {**one, "of": found}
    return None if found is None else reference_from_json(found)


def _names(reference: Reference | None) -> int:
    return 0 if reference is None else bool(reference.name) + _names(reference.of)


def labelled(line: str) -> Composed:
    """A labelled line as a sentence with its meaning.

    Raises:
        DataError: The line is not of this form.
    """
    address = cast("Address", "car")
    if (end := _ADDRESS.search(line)) is not None:
        address, line = cast("Address", end[1]), line[: end.start()]
    labels = [found[2] for found in _BRACKET.finditer(line)]
    count = iter(range(len(labels)))
    text = _BRACKET.sub(lambda found: f"@{next(count)}({found[1]})@", line)
    words: list[str] = []
    spans: list[list[int]] = [[0, 0] for _ in labels]
    names: list[list[int]] = []
    numbers: list[list[int]] = [[] for _ in labels]
    current = -1
    joined = False  # whether the next text goes on the word before it
    for part in _MARKS.split(text):
        at = len(words) - joined
        if part.startswith("@"):
            current = int(part[1:-1])
            spans[current][0] = at
        elif part == ")@":
            spans[current][1] = len(words) - 1
            current = -1
        elif part == "<":
            names.append([at, at])
        elif part == ">":
            names[-1][1] = len(words) - 1
        elif part == "#":
            if current >= 0:
                numbers[current].append(at)
        elif part:
            pieces = part.split()
            if pieces and joined and not part[0].isspace():
                words[-1] += pieces.pop(0)
            words += pieces
            joined = not part[-1].isspace()
    acts: list[WrittenAct] = []
    named = 0
    for (low, high), label, inside in zip(spans, labels, numbers, strict=True):
        act, valued, event_valued = act_of(label)
        if len(inside) != valued + event_valued or not low <= high < len(words):
            raise DataError(f"Numbers or words do not fit the label {label!r} in {line!r}.")
        # Where both have one, the label's order is the text's.
        order = [part for part in label.split() if part in ("VALUE", "CVALUE")]
        at = dict(zip(order, inside, strict=True))
        held = (act.target, act.place and act.place.ref, act.when and act.when.ref)
        wanted = sum(_names(one) for one in held)
        own = tuple((low, high) for low, high in names[named : named + wanted])
        named += wanted
        acts.append(WrittenAct(act, (low, high), at.get("VALUE"), own, at.get("CVALUE")))
    if named != len(names):
        raise DataError(f"{len(names)} names are marked and {named} are in the labels: {line!r}.")
    return Composed(tuple(words), tuple(acts), address)


def line_of(text: str, label: str) -> Composed:
    """A whole text as one act, for texts that were labelled without places."""
    said, _, rest = label.partition(" ") if label.startswith("U:") else ("U:car", "", label)
    address = cast("Address", said[2:])
    words = tuple(text.split())
    if not rest:
        return Composed(words, (), address)
    return Composed(words, (WrittenAct(act_of(rest)[0], (0, len(words) - 1)),), address)


@cache
def written(held_out: tuple[str, ...] = ()) -> tuple[Composed, ...]:
    """Every labelled line of the writers' files. Raises DataError: a line is damaged."""
    found: list[Composed] = []
    for path in sorted((data_folder("meaning") / "written").glob("*.txt")):
        if path.stem not in held_out:
            lines = path.read_text(encoding="utf-8").splitlines()
            found += [labelled(line) for line in lines if line.strip() and not line.startswith(";")]
    return tuple(found)


_ELLIPTICAL: Final = frozenset({"yes", "no", "pick", "again", "undo", "cancel", "unclear", "refuse"})


def together(first: Composed, second: Composed) -> Composed | None:
    """Two sentences said in one breath: two wishes, or a wish with a remark beside it; None where they do not go
    together.
    """
    if any(one.act.act in _ELLIPTICAL for one in (*first.acts, *second.acts)):
        return None
    if "feedback" in (first.address, second.address) or len(first.words) + len(second.words) > 55:
        return None
    if not first.acts and not second.acts and first.address != second.address:
        return None
    opening = first.words if first.words[-1][-1] in ".!?,;" else (*first.words[:-1], f"{first.words[-1]}.")
    by = len(first.words)
    later = tuple(
        WrittenAct(
            one.act,
            (one.span[0] + by, one.span[1] + by),
            None if one.value is None else one.value + by,
            tuple((low + by, high + by) for low, high in one.names),
            None if one.event_value is None else one.event_value + by,
        )
        for one in second.acts
    )
    acts = (*first.acts, *later)
    return Composed((*opening, *second.words), acts, "car" if acts else first.address)


def varied(sentence: Composed, rng: np.random.Generator) -> Composed:
    """The sentence with its sides swapped and its colours exchanged, in words and meaning alike, half the time each."""
    words = list(sentence.words)
    acts = list(sentence.acts)
    mirrored = [replace(one, act=_mirrored(one.act)) for one in acts]
    if mirrored != acts and rng.random() < 0.5:
        words, acts = [_swapped(word) for word in words], mirrored
    said = [colour for colour in COLOURS if any(_bare(word) == colour for word in words)]
    if said and rng.random() < 0.5:
        held = {colour for one in acts for colour in _colours(one.act)}
        change = {old: _PAINTS[int(rng.integers(len(_PAINTS)))] for old in said if old in held}
        if len(set(change.values())) == len(change):
            words = [word.lower().replace(_bare(word), change.get(_bare(word), _bare(word))) if _bare(word) in change
                     else word for word in words]  # fmt: skip
            acts = [replace(one, act=_coloured(one.act, change)) for one in acts]
    return replace(sentence, words=tuple(words), acts=tuple(acts))


def _bare(word: str) -> str:
    return word.lower().strip(".,;:!?'\"")


def _swapped(word: str) -> str:
    bare = _bare(word)
    return word.lower().replace(bare, _SWAPPED[bare]) if bare in _SWAPPED else word


def _mirrored(act: Act) -> Act:
    ways = {"leftmost": "rightmost", "rightmost": "leftmost"}
    return _mapped(
        replace(act, side=cast("Any", _SWAPPED.get(act.side or "")), to=cast("Any", ways.get(act.to or "", act.to))),
        lambda one: replace(one, side=cast("Any", _SWAPPED.get(one.side or ""))),
    )


def _coloured(act: Act, change: dict[str, str]) -> Act:
    return _mapped(act, lambda one: replace(one, colour=cast("Any", change.get(one.colour or "", one.colour))))


def _mapped(act: Act, by: Callable[[Reference], Reference]) -> Act:
    """An act with each of its references changed."""

    def deep(one: Reference | None) -> Reference | None:
        return None if one is None else replace(by(one), of=deep(one.of))

    return replace(
        act,
        target=deep(act.target),
        place=act.place and replace(act.place, ref=deep(act.place.ref)),
        when=act.when and replace(act.when, ref=deep(act.when.ref)),
    )


def _colours(act: Act) -> list[str]:
    found: list[str] = []

    def look(one: Reference) -> Reference:
        found.extend([one.colour] if one.colour else [])
        return one

    _mapped(act, look)
    return found
