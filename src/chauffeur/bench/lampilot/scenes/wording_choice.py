"""One wording for every item, so that a suite as a whole comes out right: lengths as in Tab. III, few repetitions.

It sees all items at once and is done in one process after the items are made, so that the result does not depend on
how the work was spread.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from chauffeur.bench.lampilot.scenes.kinds import PAPER_WORDS
from chauffeur.bench.lampilot.scenes.unambiguous import words_of
from chauffeur.concept import InstructionError
from chauffeur.language.quantities import mark_quantities
from chauffeur.language.tokens import tokens_of

Row = Mapping[str, Any]
_CLOSE_WORDS = 0.02
"""Words by which the mean length may differ from Tab. III's."""


@dataclass(frozen=True, slots=True)
class SceneChoice:
    """The words of an item, the template they came from, and their form (`form_of`)."""

    text: str
    template: str
    form: str


def normal(text: str) -> str:
    """A sentence without case, punctuation and the like: two that are equal so are the same sentence."""
    return " ".join(token for token in tokens_of(text) if token[0].isalnum())


def form_of(text: str) -> str:
    """A sentence with its quantities masked: two with the same form differ in numbers at most."""
    marked, _ = mark_quantities(tokens_of(text))
    return " ".join("#" if token[0] == "#" else token for token in marked if token[0].isalnum() or token[0] == "#")


def choose_wordings(rows: Sequence[Row], seed: int, avoid: Set[str]) -> list[SceneChoice]:
    """A wording for each row, in order.

    Args:
        rows: Made items (`making.make_item`), in the order of the plan.
        seed: The suite's.
        avoid: Sentences (`normal`) that must not be used.

    Raises:
        InstructionError: All wordings of an item are to be avoided.
    """
    uses: dict[str, Counter[str]] = defaultdict(Counter)
    options = [_options(row, avoid) for row in rows]
    chosen: list[SceneChoice] = []
    for row, held in zip(rows, options, strict=True):
        forms = uses[row["part"] or row["split"]]  # where no form should come twice
        length = int(row["length"])
        best = min(held, key=partial(_cost, forms=forms, length=length))
        forms[best.form] += 1
        chosen.append(best)
    for split in ("train", "val", "test"):
        held_in = [i for i, row in enumerate(rows) if row["split"] == split]
        _balance(options, chosen, uses[split], held_in, seed)
    return chosen


def _cost(one: SceneChoice, forms: Counter[str], length: int) -> tuple[int, int]:
    """Least is best: seldom said so far, then of the length wished."""
    return forms[one.form], abs(words_of(one.text) - length)


def _options(row: Row, avoid: Set[str]) -> list[SceneChoice]:
    held = [
        SceneChoice(text, template, form_of(text)) for text, template in row["wordings"] if normal(text) not in avoid
    ]
    if not held:
        raise InstructionError(
            f"Item {row['index']} ({row['kind']}) has no wording that is not to be avoided.",
            hint="Choose another seed.",
        )
    return held


def _balance(
    options: Sequence[Sequence[SceneChoice]],
    chosen: list[SceneChoice],
    forms: Counter[str],
    held_in: Sequence[int],
    seed: int,
) -> None:
    """Exchange wordings of a split, item by item in a random order, until their mean length is Tab. III's."""
    wanted = PAPER_WORDS[1] * len(held_in)
    total = sum(words_of(chosen[i].text) for i in held_in)
    order = np.random.default_rng(np.random.SeedSequence([seed, 2**32 + 1])).permutation(len(held_in))
    for i in (held_in[j] for j in order):
        missing = wanted - total
        if abs(missing) <= _CLOSE_WORDS * len(held_in):
            return
        now = chosen[i]
        fitting = [
            one
            for one in options[i]
            if 0 < (words_of(one.text) - words_of(now.text)) * np.sign(missing) <= max(1.0, abs(missing))
            and forms[one.form] < forms[now.form]
        ]
        if not fitting:
            continue
        better = min(fitting, key=partial(_cost, forms=forms, length=words_of(now.text)))
        total += words_of(better.text) - words_of(now.text)
        forms[now.form] -= 1
        forms[better.form] += 1
        chosen[i] = better
