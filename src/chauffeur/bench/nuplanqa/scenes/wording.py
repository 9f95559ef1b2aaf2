"""Facts put into words: questions with four options, and free question-answer pairs.

All four options come from the family's own bank of classes, and the right class is drawn as often as every other one
in each kind of ego motion: neither words nor control signals nor lengths tell which is right.
"""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, cast

from chauffeur.bench.nuplanqa.questions import PREAMBLE, VqaItem
from chauffeur.bench.nuplanqa.scenes.facts import FAMILIES, Fact
from chauffeur.concept import DataError
from chauffeur.concept.data import read_data

if TYPE_CHECKING:
    import numpy as np

    from chauffeur.bench.nuplanqa.scenes.scene import QaScene

Split = Literal["train", "val", "test"]
_OPTIONS: Final = 4
_SLACK: Final = 2
"""Questions by which a class may be ahead of the rarest one of its family."""


_NEVER_FAST: Final = ("bicycle",)
"""Classes not met at a motorway's speed, which hold no other class back there."""


@dataclass(frozen=True)
class FamilyBank:
    """Wordings of a family.

    Attributes:
        asked: Questions, by half (`train`, `test`).
        classes: Answers by class and half.
    """

    asked: Mapping[str, Sequence[str]]
    classes: Mapping[str, Mapping[str, Sequence[str]]]


@dataclass(frozen=True)
class WordBank:
    """All wordings; `motion` says how the ego moves, by half."""

    families: Mapping[str, FamilyBank]
    motion: Mapping[str, Mapping[str, str]]


@cache
def word_bank() -> WordBank:
    """The wordings of `data/nuplanqa/words.toml`. Raises DataError: they are not here, or damaged."""
    try:
        found: dict[str, Any] = tomllib.loads(read_data("nuplanqa", "words.toml").decode())
    except (ValueError, UnicodeDecodeError) as error:
        raise DataError(f"data/nuplanqa/words.toml is damaged: {error}.") from error
    motion = cast("dict[str, list[str]]", found.pop("motion"))
    halves = {"train": 0, "test": 1}
    families: dict[str, FamilyBank] = {}
    for name in FAMILIES:
        told = dict(found[name])
        asked = {"train": tuple(told.pop("asked")), "test": tuple(told.pop("test"))}
        families[name] = FamilyBank(asked, told)
    moves = {half: {name: said[place] for name, said in motion.items()} for half, place in halves.items()}
    return WordBank(families, moves)


def half_of(split: Split) -> str:
    """Half of the wordings that a split uses: those of `test` are heard nowhere else."""
    return "test" if split == "test" else "train"


@dataclass
class QuestionWriter:
    """Writes questions about scene after scene and keeps their classes balanced.

    Attributes:
        split: Of the set; decides the wordings.
    """

    split: Split
    _asked: dict[tuple[str, str, str, bool], Counter[str]] = field(
        default_factory=dict[tuple[str, str, str, bool], Counter[str]]
    )

    def write(
        self, scene: QaScene, facts: Iterable[Fact], previous: str, rng: np.random.Generator
    ) -> Iterator[VqaItem]:
        """The questions that a scene adds.

        Args:
            scene: The scene.
            facts: What can be asked about it.
            previous: Token of the sample before; empty for none.
            rng: Draws wordings and options.
        """
        for fact in facts:
            if self._wanted(scene, fact):
                yield self._item(scene, fact, previous, rng)

    @property
    def asked(self) -> list[list[Any]]:
        """Questions asked by class, as JSON; input of `go_on`."""
        return [[*group, dict(count)] for group, count in self._asked.items()]

    def go_on(self, asked: Sequence[Sequence[Any]]) -> None:
        """Take over what was asked about before."""
        self._asked = {
            (str(family), str(side), str(motion), bool(fast)): Counter(count)
            for family, side, motion, fast, count in asked
        }

    def _wanted(self, scene: QaScene, fact: Fact) -> bool:
        """True if the fact's class is not yet ahead of others, among scenes whose speeds tell the same."""
        bank = word_bank().families[fact.family]
        count = self._asked.setdefault((fact.family, fact.side, scene.motion, scene.fast), Counter())
        never = _NEVER_FAST if scene.fast else ()
        if count[fact.value] > min(count[name] for name in bank.classes if name not in never) + _SLACK - 1:
            return False
        count[fact.value] += 1
        return True

    def _item(self, scene: QaScene, fact: Fact, previous: str, rng: np.random.Generator) -> VqaItem:
        question, options, answer, _ = phrase(fact, scene.motion, half_of(self.split), rng)
        return VqaItem(
            id="",
            token=scene.token,
            previous=previous,
            subtask=FAMILIES[fact.family],
            split=self.split,
            preamble=PREAMBLE,
            speeds_mps=scene.speeds_mps,
            steering_deg=scene.steering_deg,
            question=question,
            options=options,
            answer=answer,
        )


class Phrased(NamedTuple):
    """A question with four options.

    Attributes:
        question: In words.
        options: In words, in random order.
        answer: Place of the right one.
        classes: What each option means.
    """

    question: str
    options: tuple[str, ...]
    answer: int
    classes: tuple[str, ...]


def phrase(fact: Fact, motion: str, half: str, rng: np.random.Generator) -> Phrased:
    """A question about a fact.

    Args:
        fact: What is asked about.
        motion: How the ego moves; the answers of some families name it.
        half: Of the wordings: `train` or `test`; or a part of them, see `wordings`.
        rng: Draws wordings and options.
    """
    bank = word_bank().families[fact.family]
    others = [name for name in bank.classes if name != fact.value]
    classes = [fact.value, *(others[int(place)] for place in rng.permutation(len(others))[: _OPTIONS - 1])]
    shown = tuple(classes[int(place)] for place in rng.permutation(_OPTIONS))
    options = tuple(_answer(motion, fact.family, name, half, rng) for name in shown)
    question = _pick(wordings(bank.asked, half), rng).format(side=fact.side)
    return Phrased(question, options, shown.index(fact.value), shown)


def free_pairs(
    scene: QaScene, facts: Sequence[Fact], each: int, rng: np.random.Generator
) -> Iterator[tuple[str, str, str]]:
    """Free questions and answers in training words, as (subtask, question, answer), `each` a fact."""
    for fact in facts:
        bank = word_bank().families[fact.family]
        for _ in range(each):
            question = _pick(bank.asked["train"], rng).format(side=fact.side)
            yield FAMILIES[fact.family], question, _answer(scene.motion, fact.family, fact.value, "train", rng)


def _answer(motion: str, family: str, value: str, half: str, rng: np.random.Generator) -> str:
    bank = word_bank()
    text = _pick(wordings(bank.families[family].classes[value], half), rng)
    return text.format(motion=bank.motion["test" if half == "test" else "train"][motion])


def wordings(said: Mapping[str, Sequence[str]], half: str) -> Sequence[str]:
    """Wordings of a half. To choose between ways of training without the test's, the last one of `train` may be kept
    apart: `spoken` are the others, `unspoken` is that one."""
    if half == "spoken":
        return said["train"][:-1]
    return said["train"][-1:] if half == "unspoken" else said[half]


def _pick(texts: Sequence[str], rng: np.random.Generator) -> str:
    return texts[int(rng.integers(len(texts)))]
