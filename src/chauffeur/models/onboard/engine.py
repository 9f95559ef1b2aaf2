"""The data engine: cases first, then their wordings; near-duplicates left out, splits apart, everything counted.

The same seed and versions give the same examples, with any number of processes. What is done is kept: a run that was
stopped goes on where it was.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.language.quantities import ONES, TENS
from chauffeur.models.onboard.cases import Case, case_of, make_case
from chauffeur.models.onboard.examples import (
    CORRECTION_SHARE,
    Example,
    answer_example,
    answer_sections,
    correction_example,
    wish_example,
)
from chauffeur.models.onboard.wordings import wordings

VERSION: Final = "onboard-data-v1"
PER_CASE: Final = 26
"""Wordings tried for each case."""
ANSWER_SHARE: Final = 0.2
"""Share of examples that are asked back about or refused wherever we are."""
MOST_ALIKE: Final = 24
"""Limit on a wording's occurrences, numbers and politeness masked, for the same skills."""
TEST_EVERY: Final = 25
"""Every so manieth case is kept for validation and tests; half of its wordings are of held-out templates."""

Told = Callable[[int, int], None]

_MASK = re.compile(r"\d+(?:\.\d+)?")
_NUMBER_WORDS = re.compile(rf"\b(?:{'|'.join((*ONES, *TENS))}|hundred|half|point|and a)\b")
_FILLERS = re.compile(
    r"\b(?:please|could|can|would|will|you|i|d|like|want|need|to|the|a|an|now|okay|ok|alright|hey|let|s|us|for|me|um|uh|"
    r"just|kindly|maybe|driver|car|buddy|chauffeur|thanks|thank)\b|[^a-z# ]"
)


def masked(wish: str) -> str:
    """A wish without what does not tell wordings apart: numbers, politeness, punctuation."""
    text = _NUMBER_WORDS.sub("#", _MASK.sub("#", wish.lower()))
    return re.sub(r"#(?: ?#)+", "#", " ".join(_FILLERS.sub(" ", text).split()))


def make_cases(seed: int, draws: int, path: Path, workers: int, told: Told) -> list[Case]:
    """Cases of so many draws, kept in a file of rows.

    Args:
        seed: Seed of the data set.
        draws: How many are tried; about six in ten become cases.
        path: Where they are kept.
        workers: Processes.
        told: Called with (draws done, cases so far).
    """
    rows = _stored(path)
    missing = [index for index in range(draws) if index not in rows]
    kept = sum("left_out" not in row for row in rows.values())
    with processes(workers) as pool, path.open("a", encoding="utf-8") as file:
        done = len(rows)
        for index, row in zip(missing, pool.map(make_case, ((seed, i) for i in missing), chunksize=16), strict=True):
            rows[index] = row | {"index": index}
            file.write(json.dumps(rows[index]) + "\n")
            done += 1
            kept += "left_out" not in row
            told(done, kept)
    return [case_of(rows[i]) for i in sorted(rows) if i < draws and "left_out" not in rows[i]]


def processes(workers: int) -> ProcessPoolExecutor:
    """Processes that share nothing with this one: a sandbox's threads do not survive a fork."""
    return ProcessPoolExecutor(workers, mp_context=get_context("spawn"))


def left_out(path: Path) -> Counter[str]:
    """Reasons for which draws became no cases, with counts."""
    return Counter(str(row["left_out"]) for row in _stored(path).values() if "left_out" in row)


def _stored(path: Path) -> dict[int, dict[str, Any]]:
    rows: dict[int, dict[str, Any]] = {}
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            try:
                row: dict[str, Any] = json.loads(line)
            except ValueError:
                continue  # the last line of a run that was killed
            rows[int(row["index"])] = row
    return rows


@dataclass(frozen=True, slots=True)
class Splits:
    """Examples by what they are for: training, validation on wordings of training, test on held-out wordings."""

    train: list[Example]
    seen: list[Example]
    unseen: list[Example]


def worded(cases: Sequence[Case], seed: int, per_case: int = PER_CASE) -> Splits:
    """Wordings of some cases; cases of the tests are never trained on, nor are held-out templates."""
    train: list[Example] = []
    seen: list[Example] = []
    unseen: list[Example] = []
    for case in cases:
        rng = np.random.default_rng([seed, 29, case.index])
        if case.index % TEST_EVERY:
            train += [_one(case, rng, held=False, wider=True) for _ in range(per_case)]
        else:
            for _ in range(2):
                seen.append(_one(case, rng, held=False))
                unseen.append(_one(case, rng, held=True))
    return Splits(train, seen, unseen)


def gathered(parts: Iterable[Splits]) -> Splits:
    """Splits put together, near-duplicates left out; test wishes worded as in training are no test of words."""
    train, seen, unseen = list[Example](), list[Example](), list[Example]()
    for part in parts:
        train += part.train
        seen += part.seen
        unseen += part.unseen
    train = distinct(train)
    known = {masked(example.wish) for example in train}
    return Splits(train, distinct(seen), [e for e in distinct(unseen) if masked(e.wish) not in known])


def _one(case: Case, rng: np.random.Generator, *, held: bool, wider: bool = False) -> Example:
    draw = rng.random()
    if draw < ANSWER_SHARE:
        sections = answer_sections(case.situation)
        sizes = np.array([len(wordings().templates(section, held=held)) for section in sections], float)
        section = sections[int(rng.choice(len(sections), p=sizes / sizes.sum()))]
        situation = None if rng.random() < 0.1 else case.situation
        return answer_example(section, situation, rng, held=held, wider=wider)
    if draw < ANSWER_SHARE + CORRECTION_SHARE:
        found = correction_example(case, rng, held=held, wider=wider)
        if found is not None:
            return found
    return wish_example(case, rng, held=held, wider=wider)


def distinct(examples: Iterable[Example]) -> list[Example]:
    """Examples without repeated prompts, and with each wording a few times at most for the same skills."""
    prompts: set[str] = set()
    alike: Counter[tuple[str, str]] = Counter()
    out: list[Example] = []
    for example in examples:
        form = masked(example.wish), example.skills
        if example.prompt in prompts or alike[form] >= MOST_ALIKE:
            continue
        prompts.add(example.prompt)
        alike[form] += 1
        out.append(example)
    return out
