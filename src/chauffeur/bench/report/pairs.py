"""Two runs over the same items: what flipped, and how sure the difference is."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from chauffeur.bench.kernel.metrics import AnyRow, Measure, TableSpec, missed
from chauffeur.bench.kernel.report import Line, ResultTable, fill
from chauffeur.bench.kernel.stats import Interval, sign_test
from chauffeur.bench.report.model import Flip, FlipList, asked_words, ending_words
from chauffeur.bench.report.runs import Run

ALL_PAIRS_UP_TO = 4
"""With more runs than this, only pairs with the first run are compared."""
FLIPS_LISTED = 40


def pairs_of(runs: Sequence[Run]) -> list[tuple[Run, Run]]:
    """The pairs to compare."""
    if len(runs) <= ALL_PAIRS_UP_TO:
        return list(combinations(runs, 2))
    return [(runs[0], other) for other in runs[1:]]


def pair_table(a: Run, b: Run, spec: TableSpec) -> ResultTable:
    """A pair of runs that lie over the same items (rows in the same order), in the columns of a table."""
    both = [(x, y) for x, y in zip(a.rows, b.rows, strict=True) if spec.rows(x) and spec.rows(y)]
    rows = [x for x, _ in both], [y for _, y in both]
    total = TableSpec(f"A: {a.name}; B: {b.name}", spec.measures, cluster=spec.cluster, heads=("", spec.heads[1]))
    lines: list[Line] = []
    for letter, run, mine in zip("AB", (a, b), rows, strict=True):
        for line in fill(total, mine).lines:
            lines.append(Line(f"{letter}: {run.name}", line.items, line.found, labels=run.labels))
    differences = tuple(measure.difference(*rows, cluster=spec.cluster) for measure in spec.measures)
    tests = [_test(measure, both, spec.cluster) for measure in spec.measures]
    lines += [
        Line("B \N{MINUS SIGN} A", len(both), differences),
        Line("counted in A only", None, tuple(Interval(test[0]) for test in tests), form="count"),
        Line("counted in B only", None, tuple(Interval(test[1]) for test in tests), form="count"),
        Line("McNemar p, by item", None, tuple(Interval(test[2]) for test in tests), form="p"),
        Line(f"sign test p, by {spec.cluster}", None, tuple(Interval(test[3]) for test in tests), form="p"),
    ]
    note = (
        "Differences are taken item by item on the same resamples; brackets hold 95 % intervals. Of a rate, counted in "
        "one run only, McNemar's exact test, and the same with one vote for each "
        f"{spec.cluster}, since its items hang together."
    )
    return ResultTable(total, tuple(lines), (note,))


def _test(measure: Measure, both: Sequence[tuple[AnyRow, AnyRow]], cluster: str) -> tuple[float | None, ...]:
    """Rows that only either run counts, and the p of both tests; nothing where the measure is no rate."""
    found = [(str(x[cluster]), measure.holds(x), measure.holds(y)) for x, y in both]
    known = [(name, x, y) for name, x, y in found if x is not None and y is not None]
    if measure.unit != "%" or not known:
        return (None,) * 4
    only_a, only_b = (sum((x, y) == want for _, x, y in known) for want in ((True, False), (False, True)))
    votes: dict[str, int] = {}
    for name, x, y in known:
        votes[name] = votes.get(name, 0) + y - x
    by_cluster = sign_test(sum(vote < 0 for vote in votes.values()), sum(vote > 0 for vote in votes.values()))
    return only_a, only_b, sign_test(only_a, only_b), by_cluster


def flip_list(a: Run, b: Run, spec: TableSpec, group: str, most: int = FLIPS_LISTED) -> FlipList:
    """Clusters whose rows went differently in two runs over the same items; those with the most flips first."""
    by_cluster: dict[str, list[tuple[AnyRow, AnyRow, bool]]] = {}
    for x, y in zip(a.rows, b.rows, strict=True):
        if spec.rows(x) and spec.rows(y) and (lost := missed(spec.measures, y)) != missed(spec.measures, x):
            by_cluster.setdefault(str(x[spec.cluster]), []).append((x, y, lost))
    flips = [
        Flip(
            cluster=cluster,
            group=str(pairs[0][0].get(group, "")),
            gained=sum(not lost for *_, lost in pairs),
            lost=sum(lost for *_, lost in pairs),
            words=asked_words(pairs[0][0]),
            first=ending_words(pairs[0][0]),
            second=ending_words(pairs[0][1]),
        )
        for cluster, pairs in by_cluster.items()
    ]
    flips.sort(key=lambda flip: (-(flip.gained + flip.lost), flip.cluster))
    return FlipList(a.said, b.said, tuple(flips[:most]), len(flips[most:]))
