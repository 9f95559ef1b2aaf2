"""The honest baseline of a task: a linear reader of the words, in front of the task's own exact solver."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final, Protocol

import numpy as np

from chauffeur.models.sorting.sentences import Sentence
from chauffeur.models.sorting.training import SortingRecipe, train
from chauffeur.planners.vilad.template import ActionTemplate

COMMANDS: Final = 3_000
"""As many as the paper's data sets have."""
_RECIPE: Final = SortingRecipe(epochs=12, left_out=0.2)


class AskedCommand(Protocol):
    """A command and what it asks for."""

    @property
    def text(self) -> str: ...
    @property
    def asked(self) -> Mapping[str, str]: ...


class LearnableTask(Protocol):
    """A task as its baseline learns it."""

    @property
    def template(self) -> ActionTemplate: ...
    @property
    def criteria(self) -> Sequence[str]:
        """Slots that say what was understood."""
        ...

    def command(self, rng: np.random.Generator) -> AskedCommand:
        """A command of the training split."""
        ...


def linear_reader(
    task: LearnableTask, seed: int, commands: int = COMMANDS, told: Callable[[int, int], None] | None = None
) -> Callable[[str], dict[str, str]]:
    """A reader trained on commands of the training split: softmax regression over words, pairs and parts of words.

    Args:
        task: What is learned.
        seed: Of the commands.
        commands: How many.
        told: Is told how many of the criteria are done.
    """
    rng = np.random.default_rng([seed, 11])
    found = [task.command(rng) for _ in range(commands)]
    sorters = {}
    for done, name in enumerate(task.criteria, start=1):
        kinds = next(slot.words for slot in task.template.slots if slot.name == name)
        lines = [Sentence(one.text, one.asked[name], kinds, "bank", name) for one in found]
        sorters[name] = train(lines, kinds, _RECIPE)
        if told is not None:
            told(done, len(task.criteria))

    def read(text: str) -> dict[str, str]:
        return {name: next(iter(sorter.shares(text))) for name, sorter in sorters.items()}

    return read
