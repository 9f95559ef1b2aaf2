"""Unmasking: Algorithms 1 and 2 of the paper (Sec. VII-A), in plain code, and the other rules that are in use.

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

RuleName = Literal["threshold", "factor", "top-k", "entropy"]
NEVER: Final = -1e9
"""Logit of a token that may not stand somewhere."""


@dataclass(frozen=True, slots=True)
class Unmasking:
    """How tokens are accepted.

    Attributes:
        steps: Sps: the most steps that a decision takes.
        tau: Bound of the rule. `threshold`: accept what is more confident (Algorithm 1; at 1 or more the schedule alone
            decides). `factor`: the n most confident while (n + 1)(1 - c_n) < tau (Fast-dLLM). `top-k`: so many a step.
            `entropy`: by rising entropy, while the entropies of those before sum up to at most tau.
        rule: Which.
        base: What the schedule's share ceil(L / Sps) counts: `all` tokens, as printed, or the `maskable` ones, which
            unmasks fewer a step where the pattern is long.
        temperature: Of the draw; 0 takes the most likely token, as Eq. 31.
        seed: Of the draw.
    """

    steps: int = 8
    tau: float = 0.9
    rule: RuleName = "threshold"
    base: Literal["all", "maskable"] = "maskable"
    temperature: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        """Raises ConfigError for what cannot be."""
        if self.steps < 1:
            raise ConfigError(f"Unmasking takes at least one step, not {self.steps}.")
        if not self.tau > 0.0 or self.temperature < 0.0:
            raise ConfigError(f"tau is above 0 and the temperature not below ({self.tau}, {self.temperature}).")

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
        entropy: Of the predictions' distributions, nats, (L,).
    """

    row: Array
    fixed: tuple[int, ...]
    confidence: Array
    entropy: Array


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


def entropy_of(shares: Array) -> Array:
    """Entropy over the last axis, nats."""
    return -(shares * np.log(np.maximum(shares, 1e-300))).sum(axis=-1)


def accepted(masked: list[int], confidence: Array, entropy: Array, how: Unmasking, scheduled: int) -> list[int]:
    """Which masked places keep their prediction: Algorithm 1, lines 2 to 6, and its variants.

    Line 6 as printed takes the n most confident of all L tokens; those that are fixed already would be among them and
    nothing might be unmasked, so that Algorithm 2 would not end. The n are taken of the masked ones, as in the text.

    Args:
        masked: Places that hold [M].
        confidence, entropy: Of the predictions, (L,).
        how: Rule and bound.
        scheduled: n_unmask_schedule.
    """
    by_confidence = sorted(masked, key=lambda i: (-confidence[i], i))
    if how.rule == "threshold":
        count = sum(confidence[i] > how.tau for i in masked)
    elif how.rule == "factor":
        count = 0
        for n, i in enumerate(by_confidence, start=1):
            if (n + 1) * (1.0 - confidence[i]) < how.tau:
                count = n
    elif how.rule == "top-k":
        count = int(how.tau)
    else:
        by_entropy = sorted(masked, key=lambda i: (entropy[i], i))
        before, kept = 0.0, list[int]()
        for i in by_entropy:
            if before > how.tau:
                break
            kept.append(i)
            before += float(entropy[i])
        more = [i for i in by_confidence if i not in kept]
        return kept + more[: max(0, scheduled - len(kept))]
    return by_confidence[: max(1, scheduled, count)]


def remask(row: Array, predicted: Array, confidence: Array, entropy: Array, how: Unmasking, scheduled: int) -> Array:
    """Algorithm 1: y_s from y_t and the predictions; all arrays (L,)."""
    masked = [i for i in range(len(row)) if row[i] == MASK]  # line 2
    following = row.copy()  # line 8: what is not selected stays masked
    for i in accepted(masked, confidence, entropy, how, scheduled):  # lines 3 to 7
        following[i] = predicted[i]
    return following


def unmasking(predict: Predict, canvas: Array, allowed: Array, how: Unmasking) -> Iterator[UnmaskingStep]:
    """Algorithm 2, step by step: a plan can be shown while it is still partly masked.

    Args:
        predict: The network, its prompt bound.
        canvas: y_1, int64 (L,).
        allowed: Which token may stand where, bool (L, V).
        how: Rule, bound and steps.
    """
    row = canvas.copy()
    maskable = int((row == MASK).sum())
    scheduled = how.scheduled(len(row), maskable)
    rng = np.random.default_rng(how.seed)
    while (row == MASK).any():  # line 2
        logits = np.where(allowed, predict(row), NEVER)
        shares = distribution(logits)
        predicted = drawn(logits, how.temperature, rng)  # line 3, Eq. 31
        confidence = np.where(row == MASK, shares[np.arange(len(row)), predicted], 1.0)
        entropy = entropy_of(shares)
        following = remask(row, predicted, confidence, entropy, how, scheduled)  # line 4
        new = [int(i) for i in np.flatnonzero((row == MASK) & (following != MASK))]
        row = following  # line 5
        yield UnmaskingStep(row.copy(), tuple(sorted(new, key=lambda i: (-confidence[i], i))), confidence, entropy)


def drawn(logits: Array, temperature: float, rng: np.random.Generator) -> Array:
    """Tokens of each place: the most likely, or with a temperature a draw (Gumbel's trick, in float64)."""
    if temperature == 0.0:
        return logits.argmax(axis=-1)
    noise = rng.gumbel(size=logits.shape)
    return (logits.astype(np.float64) / temperature + noise).argmax(axis=-1)


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

    A sequence that is decided is no longer asked about. Temperatures above 0 draw for each sequence as `unmask` does.

    Args:
        predict: The network, the batch's prompts bound.
        canvas: y_1 of each, int64 (B, L).
        allowed: Bool (B, L, V).
        how: Rule, bound and steps.
    """
    rows = canvas.copy()
    batch, length = rows.shape
    order, passes = np.zeros((batch, length), np.int64), np.zeros(batch, np.int64)
    sure = np.ones((batch, length))
    scheduled = [how.scheduled(length, int(many)) for many in (rows == MASK).sum(axis=1)]
    draws = [np.random.default_rng(how.seed) for _ in range(batch)]
    while (open_ := np.flatnonzero((rows == MASK).any(axis=1))).size:
        logits = np.where(allowed[open_], predict(rows[open_], open_), NEVER)
        shares = distribution(logits)
        entropy = entropy_of(shares)
        passes[open_] += 1
        if how.temperature == 0.0:
            predicted = logits.argmax(axis=-1)
        else:
            predicted = np.stack([drawn(one, how.temperature, draws[b]) for one, b in zip(logits, open_, strict=True)])
        picked = np.take_along_axis(shares, predicted[..., None], axis=-1)[..., 0]
        masked = rows[open_] == MASK
        confidence = np.where(masked, picked, 1.0)
        for at, b in enumerate(open_):
            for i in _accepted_fast(masked[at], confidence[at], entropy[at], how, scheduled[b]):
                rows[b, i], order[b, i], sure[b, i] = predicted[at, i], passes[b], confidence[at, i]
    return [Decided(rows[b], order[b], sure[b], int(passes[b])) for b in range(batch)]


def _accepted_fast(masked: Array, confidence: Array, entropy: Array, how: Unmasking, scheduled: int) -> Array:
    """`accepted`, by sorting arrays; the same places."""
    places = np.flatnonzero(masked)
    own = confidence[places]
    ranked = places[np.argsort(-own, kind="stable")]
    if how.rule == "threshold":
        count = int((own > how.tau).sum())
    elif how.rule == "factor":
        sorted_ = -np.sort(-own)
        fine = np.flatnonzero((np.arange(len(own)) + 2) * (1.0 - sorted_) < how.tau)
        count = int(fine[-1]) + 1 if fine.size else 0
    elif how.rule == "top-k":
        count = int(how.tau)
    else:
        rising = places[np.argsort(entropy[places], kind="stable")]
        values = entropy[rising]
        before = np.concatenate(([0.0], np.add.accumulate(values)[:-1]))
        kept = rising[: int(np.searchsorted(before > how.tau, True))] if (before > how.tau).any() else rising
        more = ranked[~np.isin(ranked, kept)]
        return np.concatenate((kept, more[: max(0, scheduled - len(kept))]))
    return ranked[: max(1, scheduled, count)]
