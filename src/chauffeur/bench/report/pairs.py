"""Two runs over the same items: what flipped, and how sure the difference is."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from chauffeur.bench.kernel.stats import Array, Estimator, bootstrap, sign_test
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.report import MEASURES, scene_totals
from chauffeur.bench.report import columns as col
from chauffeur.bench.report.model import Cell, Flip, FlipList, Group, ReportLine, ReportTable
from chauffeur.bench.report.runs import Run
from chauffeur.bench.report.sentences import ending_words
from chauffeur.bench.report.tables import RowSampling, interval_cell, name_with_labels, with_spans

ALL_PAIRS_UP_TO = 4
"""With more runs than this, only pairs with the first run are compared."""
FLIPS_LISTED = 40


def pairs_of(runs: Sequence[Run]) -> list[tuple[Run, Run]]:
    """The pairs to compare."""
    if len(runs) <= ALL_PAIRS_UP_TO:
        return list(combinations(runs, 2))
    return [(runs[0], other) for other in runs[1:]]


def pair_table(runs: Sequence[Run], how: RowSampling) -> ReportTable:
    """Every pair of runs that lie over the same items (rows in the same order)."""
    lines = [
        ReportLine(
            f"A: {a.name}; B: {b.name}",
            _pair_cells(a.rows, b.rows, how),
            tuple(dict.fromkeys((*a.labels, *b.labels))),
        )
        for a, b in pairs_of(runs)
    ]
    groups = (Group("", tuple(lines)),)
    notes = ["Differences are taken item by item on the same resamples of scenes; brackets hold 95 % intervals."]
    if len(runs) > ALL_PAIRS_UP_TO:
        notes.append(f"Pairs with the first run ({runs[0].name}) only.")
    return ReportTable(
        "pairs",
        "Run against run, on the same items",
        "Pair",
        with_spans((col.ITEMS, *col.PAIRS), groups),
        groups,
        notes=tuple(notes),
    )


def _pair_cells(a: Sequence[Row], b: Sequence[Row], how: RowSampling) -> tuple[Cell, ...]:
    done = [(bool(x["success"]), bool(y["success"])) for x, y in zip(a, b, strict=True)]
    only_a, only_b = done.count((True, False)), done.count((False, True))
    votes: dict[str, int] = {}
    for row, (first, second) in zip(a, done, strict=True):
        votes[str(row["sample"])] = votes.get(str(row["sample"]), 0) + int(second) - int(first)
    for_a, for_b = sum(v < 0 for v in votes.values()), sum(v > 0 for v in votes.values())
    counts = (len(done), done.count((True, True)), only_a, only_b, done.count((False, False)))
    by_key = {column.key: column for column in col.PAIRS}
    differences = bootstrap(
        np.hstack([scene_totals(a), scene_totals(b)]),
        {name: _difference(MEASURES[name]) for name in ("completion", "collision", "driving_score")},
        draws=how.draws,
        seed=how.seed,
    )
    return (
        *(Cell(f"{count:,}") for count in counts),
        Cell(p_words(sign_test(only_a, only_b))),
        Cell(p_words(sign_test(for_a, for_b)), note=f"{for_a} v {for_b} scenes"),
        interval_cell(by_key["completion"], differences["completion"], 100.0),
        interval_cell(by_key["collision"], differences["collision"], 100.0),
        interval_cell(by_key["driving_score"], differences["driving_score"]),
    )


def _difference(measure: Estimator) -> Estimator:
    """B less A of a measure, from the totals of both side by side."""

    def difference(totals: Array) -> Array:
        half = totals.shape[-1] // 2
        return measure(totals[..., half:]) - measure(totals[..., :half])

    return difference


def p_words(p: float) -> str:
    """A p value as it is read: `< 0.001`, `0.031`, `1`."""
    if p < 0.001:
        return "< 0.001"
    return "1" if p > 0.9995 else f"{p:.3f}"


def flip_list(a: Run, b: Run, most: int = FLIPS_LISTED) -> FlipList:
    """Scenes whose commands went differently in two runs over the same items; those with the most flips first."""
    by_scene: dict[str, list[tuple[Row, Row]]] = {}
    for x, y in zip(a.rows, b.rows, strict=True):
        if bool(x["success"]) != bool(y["success"]):
            by_scene.setdefault(str(x["sample"]), []).append((x, y))
    flips = [
        Flip(
            sample=sample,
            family=str(pairs[0][0]["family"]),
            gained=sum(bool(y["success"]) for _, y in pairs),
            lost=sum(bool(x["success"]) for x, _ in pairs),
            command=str(pairs[0][0]["command"]),
            first=ending_words(pairs[0][0]),
            second=ending_words(pairs[0][1]),
        )
        for sample, pairs in by_scene.items()
    ]
    flips.sort(key=lambda flip: (-(flip.gained + flip.lost), flip.sample))
    shown = flips[:most]
    return FlipList(name_with_labels(a), name_with_labels(b), tuple(shown), len(flips) - len(shown))
