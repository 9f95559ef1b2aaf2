"""Runs an exported ViLaD network with ONNX Runtime: no training library on board."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.concept import DataError
from chauffeur.language.exported import open_exported
from chauffeur.planners.vilad.template import ActionTemplate
from chauffeur.planners.vilad.unmasking import Decided, Predict, Unmasking, unmask, unmasking
from chauffeur.planners.word_table import SHIPPED_WORDS, WordTable, load_words

Array = np.ndarray[Any, Any]

SHIPPED: Final = Path(__file__).parent / "weights"
"""The parking model that comes with the package, and the word table of all models."""
SHIPPED_DRIVE: Final = SHIPPED / "drive"
"""The model of short drives that comes with the package."""


class ViladEngine:
    """One network, loaded. Not to be used by two threads at once."""

    def __init__(self, folder: Path = SHIPPED, *, threads: int = 1) -> None:
        """Load a model folder: `model.onnx`, `model.json`, and `words.npz` (the shipped one where it has none).

        Args:
            folder: Where it is.
            threads: Threads of a forward pass.

        Raises:
            DataError: A file is missing or damaged.
        """
        try:
            self.about, self._session = open_exported(folder, threads)
        except Exception as error:  # the runtime raises types of its own for a damaged graph
            raise DataError(f"The ViLaD model in {folder} cannot be read: {error}.") from error
        own = folder / "words.npz"
        self.words: WordTable = load_words(own if own.exists() else SHIPPED_WORDS)

    @property
    def version(self) -> str:
        """Of the model; stands in every result."""
        return str(self.about["version"])

    def predict(self, text: str, scene: Array) -> Predict:
        """The network with its prompt bound.

        Args:
            text: The command.
            scene: Features of the candidates, float32 (S, width).
        """
        feed = {"words": self.words.vectors(self.words.tokens(text))[None], "scene": scene[None]}

        def logits(row: Array) -> Array:
            return np.asarray(self._session.run(None, {**feed, "rows": row[None]})[0][0])

        return logits

    def decide(self, template: ActionTemplate, text: str, scene: Array, how: Unmasking) -> Decided:
        """A decision (Algorithm 2); arguments as above."""
        return unmask(self.predict(text, scene), template.canvas, template.allowed(len(scene)), how)

    def steps(self, template: ActionTemplate, text: str, scene: Array, how: Unmasking) -> list[Array]:
        """y_s after each step of a decision, partly masked; for those who want to see it form."""
        found = unmasking(self.predict(text, scene), template.canvas, template.allowed(len(scene)), how)
        return [step.row for step in found]


@cache
def shipped(folder: Path = SHIPPED) -> ViladEngine:
    """A model of the package, loaded once."""
    return ViladEngine(folder)
