# pyright: reportMissingImports=false
"""The recipe of short drives: a command, a fresh street, and the way, the stop and the waypoints that fit both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from chauffeur.concept import Street
from chauffeur.models.vilad.driving_words import DriveCommand, drive_command
from chauffeur.models.vilad.evaluation import Judged, Values
from chauffeur.models.vilad.phrases import TESTS, Split
from chauffeur.planners.vilad import driving
from chauffeur.planners.vilad.driving import (
    CRITERIA,
    TEMPLATE,
    DriveGoal,
    asked_of_drive,
    driving_agreement,
    features,
    fulfils,
    goal,
    reference,
    references,
    verified_drive,
)
from chauffeur.planners.vilad.template import ActionTemplate
from chauffeur.planners.vilad.unmasking import Decided, Predict
from chauffeur.worlds.track.street import StreetConfig, draw_street, street_of

Array = np.ndarray[Any, Any]

IMPOSSIBLE: Final = 0.08
"""Share of commands that are kept though the street that was drawn for them has no way, no mark or no room."""
_TRIES: Final = 16


def fresh_street(rng: np.random.Generator, said: DriveCommand) -> tuple[StreetConfig, Street]:
    """A street for a command: most often one on which it can be done."""
    any_street = rng.random() < IMPOSSIBLE
    while True:
        for _ in range(_TRIES):
            config = draw_street(rng)
            street = street_of(config)
            if any_street or isinstance(goal(street, said.asked), DriveGoal):
                return config, street
        any_street = True


class DrivingTask:
    """See ViladTask."""

    template: ActionTemplate = TEMPLATE
    width: int = driving.WIDTH
    criteria: Sequence[str] = CRITERIA

    def command(self, rng: np.random.Generator, split: Split = "train") -> DriveCommand:
        return drive_command(rng, split)

    def answered(self, rng: np.random.Generator, said: Sequence[DriveCommand]) -> tuple[Array, Array]:
        """See ViladTask. Scenes are filled up with candidates that are nothing."""
        streets = [fresh_street(rng, one)[1] for one in said]
        answers = references([(street, one.asked) for street, one in zip(streets, said, strict=True)])
        scenes = [features(street) for street in streets]
        most = max(map(len, scenes))
        table = np.zeros((len(said), most, self.width), np.float32)
        for row, one in zip(table, scenes, strict=True):
            row[: len(one)] = one
        return table, np.stack([TEMPLATE.encode(values) for values in answers])


DRIVING: Final = DrivingTask()


@dataclass(frozen=True, slots=True)
class DriveCase:
    """One command on one street; see ViladCase.

    Attributes:
        text: The words.
        asked: What they ask for.
        config: The street, as a world drives it.
        street: The street, as it is described.
    """

    text: str
    asked: dict[str, str]
    config: StreetConfig
    street: Street

    @property
    def template(self) -> ActionTemplate:
        """The pattern of answers."""
        return TEMPLATE

    def features(self) -> Array:
        """Ways on, and what there is to stop by."""
        return features(self.street)

    def judged(self, values: Values) -> Judged:
        """Success: the way, the end within 2 m, at the kerb or not, the pace; or no drive where none can be."""
        agrees = driving_agreement(self.street, values)
        understood = asked_of_drive(values) == self.asked
        return Judged(fulfils(self.street, self.asked, values), understood, agrees.waypoints, agrees.pointers)

    def verified(self, predict: Predict, decided: Decided) -> Decided:
        return verified_drive(predict, self.street, decided)

    def solved(self, asked: Mapping[str, str]) -> bool:
        """True if the ideal drive for what a reader understood is what was meant."""
        return fulfils(self.street, self.asked, reference(self.street, asked))


def drive_cases(split: Split, count: int, seed: int) -> list[DriveCase]:
    """Test cases of a split."""
    rng = np.random.default_rng([seed, 13, TESTS.index(split)])
    found: list[DriveCase] = []
    for _ in range(count):
        said = drive_command(rng, split)
        found.append(DriveCase(said.text, dict(said.asked), *fresh_street(rng, said)))
    return found
