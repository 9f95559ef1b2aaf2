"""Training a sorter: softmax regression over the marks of sentences, the same from the same seed.

Plain NumPy: some ten thousand sentences take less than a minute. A share of each sentence's marks is left out at every
look (dropout), so that no kind hangs on a single word.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.driving.files import publish
from chauffeur.language.text_classifier import BITS, TextClassifier, hashed_features
from chauffeur.models.sorting.sentences import Sentence

Array = np.ndarray[Any, Any]
Told = Callable[[float], None]
"""Is told the share that is done."""

_BATCH: Final = 512
_FIRST, _SECOND, _TINY = 0.9, 0.999, 1e-8
_NEVER: Final = -30.0
_STEPS: Final = 127


def _unheard(share: float) -> None:
    del share


@dataclass(frozen=True, slots=True)
class SortingRecipe:
    """Settings that decide a training.

    Attributes:
        epochs: How often every sentence is looked at.
        rate: First learning rate; it falls to nothing in a line.
        left_out: Share of marks left out at each look.
        decay: Of weights (L2).
        seed: Of order and dropout.
    """

    epochs: int = 40
    rate: float = 0.02
    left_out: float = 0.4
    decay: float = 1e-6
    seed: int = 0


def train(
    found: Sequence[Sentence], kinds: Sequence[str], recipe: SortingRecipe, told: Told = _unheard
) -> TextClassifier:
    """A sorter of sentences.

    Args:
        found: To learn from.
        kinds: What it is to find.
        recipe: How.
        told: Is told how far it is.
    """
    rng = np.random.default_rng(recipe.seed)
    marks = [hashed_features(one.text) for one in found]
    wanted = np.array([kinds.index(one.kind) for one in found])
    barred = np.array([[0.0 if kind in one.among else _NEVER for kind in kinds] for one in found], np.float32)
    fit = _Fit(len(kinds))
    steps = recipe.epochs * -(-len(found) // _BATCH)
    step = 0
    for _ in range(recipe.epochs):
        order = rng.permutation(len(found))
        for start in range(0, len(found), _BATCH):
            some = order[start : start + _BATCH]
            batch = _Batch([marks[index] for index in some], wanted[some], barred[some])
            fit.look(batch, recipe, rng, 1.0 - step / steps)
            step += 1
        told(step / steps)
    return _rounded(tuple(kinds), fit.weights, fit.bias)


@dataclass(frozen=True, slots=True)
class _Batch:
    """Sentences looked at together: their marks, their kinds, and what each cannot be (logarithms, 0 or far below)."""

    marks: list[Array]
    wanted: Array
    barred: Array


class _Fit:
    """Weights while they are learned."""

    def __init__(self, kinds: int) -> None:
        self.weights = np.zeros((1 << BITS, kinds), np.float32)
        self.bias = np.zeros(kinds, np.float32)
        self._weights_moments, self._bias_moments = _Moments(self.weights), _Moments(self.bias)
        self._looks = 0

    def look(self, batch: _Batch, recipe: SortingRecipe, rng: np.random.Generator, left: float) -> None:
        """One step; `left` is the share of the training that is left."""
        lengths = np.array([len(one) for one in batch.marks])
        flat, many = np.concatenate(batch.marks), len(batch.marks)
        of = np.repeat(np.arange(many), lengths)
        kept = rng.random(len(flat)) >= recipe.left_out
        worth = (kept / (1.0 - recipe.left_out) / np.sqrt(lengths)[of]).astype(np.float32)
        scores = batch.barred + self.bias
        np.add.at(scores, of, self.weights[flat] * worth[:, None])
        scores = np.exp(scores - scores.max(axis=1, keepdims=True))
        error = scores / scores.sum(axis=1, keepdims=True)
        error[np.arange(many), batch.wanted] -= 1.0
        error /= many
        slope = 2.0 * recipe.decay * self.weights
        np.add.at(slope, flat, error[of] * worth[:, None])
        self._looks += 1
        pace = recipe.rate * left * np.sqrt(1.0 - _SECOND**self._looks) / (1.0 - _FIRST**self._looks)
        self._weights_moments.move(self.weights, slope, pace)
        self._bias_moments.move(self.bias, error.sum(axis=0), pace)


class _Moments:
    """Running means of slopes and of their squares: Adam (Kingma and Ba 2015)."""

    def __init__(self, like: Array) -> None:
        self._first, self._second = np.zeros_like(like), np.zeros_like(like)

    def move(self, values: Array, slope: Array, pace: float) -> None:
        """One step, in place."""
        self._first += (1.0 - _FIRST) * (slope - self._first)
        self._second += (1.0 - _SECOND) * (slope * slope - self._second)
        values -= pace * self._first / (np.sqrt(self._second) + _TINY)


def _rounded(kinds: tuple[str, ...], weights: Array, bias: Array) -> TextClassifier:
    steps = np.maximum(np.abs(weights).max(axis=0), 1e-6) / _STEPS
    return TextClassifier(
        kinds, np.round(weights / steps).astype(np.int8), steps.astype(np.float64), bias.astype(np.float64)
    )


def right(sorter: TextClassifier, found: Sequence[Sentence]) -> Array:
    """Which sentences it sorts as their writers meant them; shape (n,)."""
    return np.array([next(iter(sorter.shares(one.text, one.among))) == one.kind for one in found])


def by_writer(
    found: Sequence[Sentence], kinds: Sequence[str], recipe: SortingRecipe, told: Told = _unheard, parts: int = 5
) -> Array:
    """The same for sentences of writers that were never learned from; shape (n,).

    A sorter is trained without each of so many parts of the writers in turn: with fewer parts it is sooner done, and
    sees less.
    """
    writers = sorted({one.writer for one in found})
    hits = np.zeros(len(found), np.bool_)
    parts = min(parts, len(writers))
    for turn in range(parts):
        left_out = writers[turn::parts]
        others = [one for one in found if one.writer not in left_out]
        own = [index for index, one in enumerate(found) if one.writer in left_out]
        sorter = train(others, kinds, recipe)
        hits[own] = right(sorter, [found[index] for index in own])
        told((turn + 1) / parts)
    return hits


def write(sorter: TextClassifier, path: Path) -> None:
    """Store a sorter for `load_sorter`."""
    stream = io.BytesIO()
    sorter.store(stream)
    publish(path, stream.getvalue(), "sorter")
