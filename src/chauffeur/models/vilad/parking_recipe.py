# pyright: reportMissingImports=false
"""The parking recipe: a wish, the free spots of a fresh lot, and the best of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from chauffeur.models.vilad.evaluation import Judged, Values
from chauffeur.models.vilad.parking_scenes import FEWEST, MOST, scene
from chauffeur.models.vilad.parking_words import ParkingCommand, wish
from chauffeur.models.vilad.phrases import TESTS, Split
from chauffeur.planners.vilad import parking
from chauffeur.planners.vilad.parking import CRITERIA, TEMPLATE, Spots, agreement, answer, asked_of, best, verified
from chauffeur.planners.vilad.template import ActionTemplate
from chauffeur.planners.vilad.unmasking import Decided, Predict

Array = np.ndarray[Any, Any]


class ParkingTask:
    """See ViladTask."""

    template: ActionTemplate = TEMPLATE
    width: int = parking.WIDTH
    criteria: Sequence[str] = CRITERIA

    def command(self, rng: np.random.Generator, split: Split = "train") -> ParkingCommand:
        return wish(rng, split)

    def answered(self, rng: np.random.Generator, said: Sequence[ParkingCommand]) -> tuple[Array, Array]:
        free = int(rng.integers(FEWEST, MOST + 1))
        scenes = [scene(rng, free) for _ in said]
        rows = [
            TEMPLATE.encode(answer(spots, one.asked, best(spots, one.asked)[0]))
            for one, spots in zip(said, scenes, strict=True)
        ]
        return np.stack([spots.features() for spots in scenes]), np.stack(rows)


PARKING: Final = ParkingTask()


@dataclass(frozen=True, slots=True)
class ParkingCase:
    """One command in one scene; see ViladCase.

    Attributes:
        text: The words.
        asked: What they ask for.
        spots: The free spots.
        candidate: The best of them.
    """

    text: str
    asked: dict[str, str]
    spots: Spots
    candidate: int

    @property
    def template(self) -> ActionTemplate:
        """The pattern of answers."""
        return TEMPLATE

    def features(self) -> Array:
        """The free spots."""
        return self.spots.features()

    def judged(self, values: Values) -> Judged:
        """Success: among the best spots for what was meant, within 2 m of walking, all conditions kept."""
        agrees = agreement(self.spots, values)
        success = bool(best(self.spots, self.asked)[1][int(values["spot"])])
        return Judged(success, asked_of(values) == self.asked, agrees.row, agrees.spot)

    def verified(self, predict: Predict, decided: Decided) -> Decided:
        return verified(predict, self.spots, decided)

    def solved(self, asked: Mapping[str, str]) -> bool:
        """True if the best spot for what a reader understood is among the best for what was meant."""
        return bool(best(self.spots, self.asked)[1][best(self.spots, asked)[0]])


def case(rng: np.random.Generator, split: Split, free: int) -> ParkingCase:
    """A fresh one."""
    said, spots = wish(rng, split), scene(rng, free)
    return ParkingCase(said.text, dict(said.asked), spots, best(spots, said.asked)[0])


def cases(split: Split, count: int, seed: int) -> list[ParkingCase]:
    """Test cases of a split."""
    rng = np.random.default_rng([seed, 7, TESTS.index(split)])
    return [case(rng, split, int(rng.integers(FEWEST, MOST + 1))) for _ in range(count)]
