"""Unmasking: Algorithms 1 and 2 of the paper (Sec. VII-A), in plain code.

Algorithm 2 begins with every action masked. At each step the network predicts all masked tokens at once (Eq. 31), and
Algorithm 1 keeps the predictions that are confident enough and masks the others again. What is easy is fixed first, and
what is hard is decided with the easy part in sight.

Conditional independence is the price of parallel decisions: tokens that are unmasked in one step are drawn from the
product of their own distributions, not from their joint one. The threshold tau limits that to tokens of which the
network is nearly certain.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from chauffeur.concept import ConfigError
from chauffeur.planners.vilad.template import MASK

Array = np.ndarray[Any, Any]

Predict = Callable[[Array], Array]
"""Logits (L, V) of a sequence y_t, int64 (L,): the network, with the prompt X_input bound to it."""

NEVER: Final = -1e9
"""Logit of a token that may not stand somewhere."""


@dataclass(frozen=True, slots=True)
class Unmasking:
    """The acceptance rule of a decision.

    Attributes:
        steps: Sps: the most steps that a decision takes.
        tau: Predictions that are more confident are accepted (Algorithm 1); at 1 or more the schedule alone decides.
        base: What the schedule's share ceil(L / Sps) counts: `all` tokens, as printed, or the `maskable` ones, which
            unmasks fewer a step where the pattern is long.
    """

    steps: int = 8
    tau: float = 0.9
    base: Literal["all", "maskable"] = "maskable"

    def __post_init__(self) -> None:
        """Raises ConfigError for what cannot be."""
        if self.steps < 1:
            raise ConfigError(f"Unmasking takes at least one step, not {self.steps}.")
        if not self.tau > 0.0:
            raise ConfigError(f"tau is above 0, not {self.tau}.")

    def scheduled(self, length: int, maskable: int) -> int:
        """Tokens that a step unmasks at least: line 3 of Algorithm 1."""
        return math.ceil((length if self.base == "all" else maskable) / self.steps)


PAPER: Final = Unmasking(steps=8, tau=0.5, base="all")
"""As printed: tau of ViLaD-Opt (Sec. VII-B), all tokens counted."""


@dataclass(frozen=True, slots=True)
class UnmaskingStep:
    """One step of Algorithm 2.

    Attributes:
        row: y_s after it, int64 (L,).
        fixed: Places that it unmasked, the most confident first.
        confidence: p(y_0^i | X_t) of the predictions, (L,); 1 where a token was fixed before.
    """

    row: Array
    fixed: tuple[int, ...]
    confidence: Array


@dataclass(frozen=True, slots=True)
class Decided:
    """A decision.

    Attributes:
        row: y_0, int64 (L,).
        order: The step at which each token was unmasked, from 1; 0 for the fixed pattern; (L,).
        confidence: Of each token when it was unmasked; 1 for the fixed pattern; (L,).
        passes: Forward passes of the network (NFE).
    """

    row: Array
    order: Array
    confidence: Array
    passes: int


def distribution(logits: Array) -> Array:
    """Softmax over the last axis, in float64."""
    raised = np.exp(logits.astype(np.float64) - logits.max(axis=-1, keepdims=True))
    return raised / raised.sum(axis=-1, keepdims=True)


def accepted(masked: Array, confidence: Array, how: Unmasking, scheduled: int) -> Array:
    """Masked places that keep their prediction, the most confident first: Algorithm 1, lines 2 to 6.

    Line 6 as printed takes the n most confident of all L tokens; those that are fixed already would be among them and
    nothing might be unmasked, so that Algorithm 2 would not end. The n are taken of the masked ones, as in the text.

    Args:
        masked: Which places hold [M], bool (L,).
        confidence: Of the predictions, (L,).
        how: The bound.
        scheduled: n_unmask_schedule.
    """
    places = np.flatnonzero(masked)
    own = confidence[places]
    count = int((own > how.tau).sum())
    return places[np.argsort(-own, kind="stable")][: max(1, scheduled, count)]


def unmasking(predict: Predict, canvas: Array, allowed: Array, how: Unmasking) -> Iterator[UnmaskingStep]:
    """Algorithm 2, step by step: a plan can be shown while it is still partly masked.

    Args:
        predict: The network, its prompt bound.
        canvas: y_1, int64 (L,).
        allowed: Which token may stand where, bool (L, V).
        how: Bound and steps.
    """
    row = canvas.copy()
    scheduled = how.scheduled(len(row), int((row == MASK).sum()))
    while (masked := row == MASK).any():  # line 2
        logits = np.where(allowed, predict(row), NEVER)
        predicted = logits.argmax(axis=-1)  # line 3, Eq. 31
        confidence = np.where(masked, distribution(logits)[np.arange(len(row)), predicted], 1.0)
        fixed = accepted(masked, confidence, how, scheduled)  # line 4
        row[fixed] = predicted[fixed]  # line 5
        yield UnmaskingStep(row.copy(), tuple(fixed.tolist()), confidence)


def unmask(predict: Predict, canvas: Array, allowed: Array, how: Unmasking) -> Decided:
    """Algorithm 2 to its end."""
    order = np.zeros(len(canvas), np.int64)
    sure = np.ones(len(canvas))
    row, passes = canvas, 0
    for passes, step in enumerate(unmasking(predict, canvas, allowed, how), start=1):
        row = step.row
        for i in step.fixed:
            order[i], sure[i] = passes, step.confidence[i]
    return Decided(row, order, sure, passes)


PredictMany = Callable[[Array, Array], Array]
"""Logits (n, L, V) of rows (n, L) of a batch; the second argument says which prompts they belong to, (n,)."""


def unmask_many(predict: PredictMany, canvas: Array, allowed: Array, how: Unmasking) -> list[Decided]:
    """Algorithm 2 for a batch at once: the same tokens as `unmask` one by one, in fewer calls of the network.

    A sequence that is decided is no longer asked about.

    Args:
        predict: The network, the batch's prompts bound.
        canvas: y_1 of each, int64 (B, L).
        allowed: Bool (B, L, V).
        how: Bound and steps.
    """
    rows = canvas.copy()
    batch, length = rows.shape
    order, passes = np.zeros((batch, length), np.int64), np.zeros(batch, np.int64)
    sure = np.ones((batch, length))
    scheduled = [how.scheduled(length, int(many)) for many in (rows == MASK).sum(axis=1)]
    while (open_ := np.flatnonzero((rows == MASK).any(axis=1))).size:
        logits = np.where(allowed[open_], predict(rows[open_], open_), NEVER)
        passes[open_] += 1
        predicted = logits.argmax(axis=-1)
        picked = np.take_along_axis(distribution(logits), predicted[..., None], axis=-1)[..., 0]
        masked = rows[open_] == MASK
        confidence = np.where(masked, picked, 1.0)
        for at, b in enumerate(open_):
            fixed = accepted(masked[at], confidence[at], how, scheduled[b])
            rows[b, fixed], order[b, fixed], sure[b, fixed] = predicted[at, fixed], passes[b], confidence[at, fixed]
    return [Decided(rows[b], order[b], sure[b], int(passes[b])) for b in range(batch)]
