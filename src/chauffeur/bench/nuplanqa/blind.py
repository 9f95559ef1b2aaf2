"""Baseline by the words of the options alone; it stands beside every result.

A conditional logit (McFadden 1974) over the four options: words, pairs of words and lengths of an option, each also
together with the subtask, give it a score, and the highest score is the guess. No picture, no question. On the
published evaluation file such a classifier is right more often than the best model of the paper, because wordings
differ between right options and distractors; a data set that it cannot solve has no such shortcut.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from chauffeur.bench.nuplanqa.questions import VqaItem

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    FloatArray = NDArray[np.float64]
    IntArray = NDArray[np.int64]

BASELINE: Final = "blind-v1"
FOLDS: Final = 5
_BITS: Final = 17
_STEPS: Final = 120
_RATE: Final = 0.12
_DECAY: Final = 2e-3
LEAST_ITEMS: Final = 100
"""With fewer questions there is nothing to learn from, and no baseline."""


@dataclass(frozen=True, eq=False)
class BlindModel:
    """Weights of hashed features, (2 ** bits,).

    Attributes:
        weights: What a feature adds to the score of its option.
        signals: Whether it also reads velocity and steering, each together with every word.
    """

    weights: FloatArray
    signals: bool

    def guess(self, items: Sequence[VqaItem]) -> IntArray:
        """Index of the option it takes for right, (items,)."""
        import numpy as np

        if not items:
            return np.zeros(0, np.int64)
        columns, owners = _matrix(items, self.signals)
        return _scores(self.weights, columns, owners, len(items)).argmax(axis=1)


def fit_blind(items: Sequence[VqaItem], *, signals: bool = False) -> BlindModel:
    """Learn from questions with their answers: full-batch Adam on the log-likelihood with weight decay."""
    import numpy as np

    hashed, owners = _matrix(items, signals)
    known, columns = np.unique(hashed, return_inverse=True)  # only features that occur are learned
    right = np.zeros((len(items), 4))
    right[np.arange(len(items)), [item.answer for item in items]] = 1.0
    weights, mean, square = (np.zeros(len(known)) for _ in range(3))
    for step in range(1, _STEPS + 1):
        scores = _scores(weights, columns, owners, len(items))
        likely = np.exp(scores - scores.max(axis=1, keepdims=True))
        likely /= likely.sum(axis=1, keepdims=True)
        error = ((likely - right) / len(items)).ravel()
        slope = np.bincount(columns, error[owners], len(known)) + _DECAY / len(items) * weights
        mean = 0.9 * mean + 0.1 * slope
        square = 0.999 * square + 0.001 * slope * slope
        weights -= _RATE * (mean / (1 - 0.9**step)) / (np.sqrt(square / (1 - 0.999**step)) + 1e-9)
    whole = np.zeros(1 << _BITS)
    whole[known] = weights
    return BlindModel(whole, signals)


def blind_guesses(items: Sequence[VqaItem], *, signals: bool = False, folds: int = FOLDS) -> list[int] | None:
    """A guess for every question, by a model that has seen none of its scene; None for a set too small to learn from.

    Scenes (chains of samples) are dealt to folds by a hash of their name, so that the same set gives the same guesses.
    """
    chains = {item.chain or item.token for item in items}
    if len(items) < LEAST_ITEMS or len(chains) < 2 * folds:
        return None
    found = [0] * len(items)
    fold_of = [_bucket(item.chain or item.token, folds) for item in items]
    for fold in range(folds):
        inside = [place for place, one in enumerate(fold_of) if one == fold]
        outside = [item for item, one in zip(items, fold_of, strict=True) if one != fold]
        if not inside or not outside:
            continue
        model = fit_blind(outside, signals=signals)
        for place, guess in zip(inside, model.guess([items[i] for i in inside]).tolist(), strict=True):
            found[place] = guess
    return found


def by_length(item: VqaItem, *, longest: bool) -> int:
    """The option with the longest (else shortest) text; the first of equals."""
    lengths = [len(option) for option in item.options]
    return lengths.index(max(lengths) if longest else min(lengths))


def _scores(weights: FloatArray, columns: IntArray, owners: IntArray, count: int) -> FloatArray:
    import numpy as np

    totals: FloatArray = np.bincount(owners, weights[columns], 4 * count).astype(np.float64)
    return totals.reshape(count, 4)


def _matrix(items: Sequence[VqaItem], signals: bool) -> tuple[IntArray, IntArray]:
    """Hashed features of all options, and which option (4 x item + index) each belongs to."""
    import numpy as np

    columns: list[int] = []
    owners: list[int] = []
    for place, item in enumerate(items):
        for index, features in enumerate(_features(item, signals)):
            columns += [_bucket(feature, 1 << _BITS) for feature in features]
            owners += [4 * place + index] * len(features)
    return np.array(columns, np.int64), np.array(owners, np.int64)


def _features(item: VqaItem, signals: bool) -> list[list[str]]:
    words = [re.findall(r"\w+", option.lower()) for option in item.options]
    ranks = sorted(range(len(words)), key=lambda index: len(item.options[index]))
    motion = _motion(item) if signals else ""
    found: list[list[str]] = []
    for index, said in enumerate(words):
        pairs = [f"{one} {two}" for one, two in zip(["^", *said], [*said, "$"], strict=True)]
        plain = [*said, *pairs, f"#rank {ranks.index(index)}", f"#words {min(len(said), 20)}", f"= {' '.join(said)}"]
        crossed = [f"{item.subtask}|{feature}" for feature in plain]
        moved = [f"{item.subtask}|{motion}|{feature}" for feature in plain] if signals else []
        found.append([*plain, *crossed, *moved])
    return found


def _motion(item: VqaItem) -> str:
    """Velocity and steering in words."""
    speeds, angles = item.speeds_mps, item.steering_deg
    if not speeds:
        return ""
    change = speeds[-1] - speeds[0]
    gained = "up" if change > 0.5 else "down" if change < -0.5 else "same"
    pace = "still" if speeds[-1] < 0.5 else "slow" if speeds[-1] < 6.0 else "medium" if speeds[-1] < 13.0 else "fast"
    turned = max(angles, key=abs) if angles else 0.0
    side = "left" if turned > 2.0 else "right" if turned < -2.0 else "straight"
    return f"{gained} {pace} {side}"


_KNOWN: Final[dict[tuple[str, int], int]] = {}


def _bucket(text: str, count: int) -> int:
    key = (text, count)
    if key not in _KNOWN:
        if len(_KNOWN) > 500_000:
            _KNOWN.clear()
        _KNOWN[key] = int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "big") % count
    return _KNOWN[key]
