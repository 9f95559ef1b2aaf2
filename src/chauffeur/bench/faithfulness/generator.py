"""Generated cases: half of them aligned, half with one mismatch. Same seed, same cases."""

from __future__ import annotations

from typing import Final

import numpy as np

from chauffeur.bench.faithfulness.cases import ALIGNED, KINDS, FaithfulnessCase
from chauffeur.bench.faithfulness.deeds import deeds_of, tellable
from chauffeur.bench.faithfulness.faults import spoil
from chauffeur.bench.faithfulness.plans import PlannedCase, draw
from chauffeur.bench.faithfulness.prose import TOLD, tell

COUNT: Final = 2400
SEED: Final = 7


def generate(count: int = COUNT, seed: int = SEED) -> tuple[FaithfulnessCase, ...]:
    """Cases in turn aligned and mismatched, the kinds of mismatch in turn.

    Args:
        count: How many.
        seed: Seed of every choice.
    """
    rng = np.random.default_rng(seed)
    kinds = KINDS[1:]
    cases: list[FaithfulnessCase] = []
    while len(cases) < count:
        index = len(cases)
        kind = ALIGNED if index % 2 == 0 else kinds[(index // 2) % len(kinds)]
        found = None
        while found is None:
            found = _case(rng, draw(rng), kind, f"g{seed}-{index:05d}")
        cases.append(found)
    return tuple(cases)


def _case(rng: np.random.Generator, planned: PlannedCase, kind: str, name: str) -> FaithfulnessCase | None:
    changed = ""
    if kind == ALIGNED:
        deeds = deeds_of(planned)
        if not tellable(deeds, TOLD):
            return None
        text, source = tell(rng, deeds, planned.wish, planned.start), planned.program
    else:
        spoiled = spoil(rng, planned, kind)
        if spoiled is None:
            return None
        text, source, changed = spoiled
    start = planned.start
    return FaithfulnessCase(name, text, source, kind, start.where, changed, planned.intent, start.scenario, start.seed)
