"""One item of a suite made from its place in the plan: draw, check, redraw, and word. Values in, JSON values out."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from chauffeur.bench.lampilot.scenes.feasible import FeasibilityVerdict, feasible, impossible, start_of
from chauffeur.bench.lampilot.scenes.kinds import KINDS, Slot
from chauffeur.bench.lampilot.scenes.wish_sampler import Unfit
from chauffeur.bench.lampilot.scenes.wishes import SceneWish
from chauffeur.bench.lampilot.scenes.wording import Candidates, word
from chauffeur.concept import Scenario, ScenarioError
from chauffeur.worlds.highway import HighwayWorld

MAX_DRAWS = 400
"""Draws after which an item is given up: a kind that fails so often has a fault of its own."""
_WORDS_KEY = 1_000_000
"""Spawn key of the stream that words are drawn from; scenes are drawn from keys 0, 1, 2, ..."""


@dataclass(frozen=True, slots=True)
class Job:
    """An item to be made, with the suite's seed."""

    seed: int
    slot: Slot

    @property
    def key(self) -> str:
        """Name of the item while it has no file."""
        return str(self.slot.index)


def make_item(job: Job) -> dict[str, Any]:
    """Draw until a scene is feasible, then word it; a row keyed by `index`.

    Everything random comes from `SeedSequence([seed, index])`, so an item does not depend on the worker or the time.

    Raises:
        ScenarioError: No feasible scene came up.
    """
    slot, kind = job.slot, KINDS[job.slot.kind]
    rejected: Counter[str] = Counter()
    for draw in range(MAX_DRAWS):
        rng = _stream(job, draw)
        env = kind.road(rng)
        traffic = int(rng.integers(2**31))
        scenario = Scenario(f"{slot.kind}_{slot.index}", "highway", env, traffic)
        start = start_of(HighwayWorld(), scenario)
        if isinstance(start, str):
            rejected[start] += 1
            continue
        wish = kind.wish(slot.kind, start, rng)
        if isinstance(wish, Unfit):
            rejected[wish.why] += 1
            continue
        verdict = FeasibilityVerdict(True)
        if wish.right == "drive":
            verdict = feasible(replace(scenario, goal=wish.goal))
        elif "_no_" in slot.kind and not impossible(scenario, wish.origin):
            verdict = FeasibilityVerdict(False, "the wish is possible here")
        if verdict.why:
            rejected[verdict.why] += 1
            continue
        candidates = word(wish, kind, slot, _stream(job, _WORDS_KEY))
        return _row(slot, scenario, wish, candidates, verdict, rejected)
    most = ", ".join(f"{why} ({times})" for why, times in rejected.most_common(3))
    raise ScenarioError(
        f"No feasible scene of kind {slot.kind!r} in {MAX_DRAWS} draws (item {slot.index}): {most}.",
        hint="This is a fault of the generator; please report it with the seed.",
    )


def _stream(job: Job, key: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence([job.seed, job.slot.index], spawn_key=(key,)))


def _row(
    slot: Slot,
    scenario: Scenario,
    wish: SceneWish,
    candidates: Candidates,
    verdict: FeasibilityVerdict,
    rejected: Counter[str],
) -> dict[str, Any]:
    row = asdict(slot) | {
        "env": scenario.config,
        "seed": scenario.seed,
        "goal": wish.goal,
        "origin": wish.origin,
        "stem": wish.stem,
        "slots": [[name, value if isinstance(value, str) else asdict(value)] for name, value in wish.slots],
        "right": wish.right,
        "why": wish.why,
        "solved_by": verdict.by,
        "expert_ticks": verdict.ticks,
        "rejected": dict(rejected),
        "wordings": [[one.text, one.template] for one in candidates.wordings],
        "length": candidates.length,
        "said": candidates.said,
        "misread": dict(candidates.misread),
    }
    row["index"] = str(slot.index)
    return row
