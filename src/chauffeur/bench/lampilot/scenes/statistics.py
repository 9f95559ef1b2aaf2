"""The columns of Tab. III for any DbLv1 folder."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from chauffeur.bench.lampilot.families import FAMILIES, family_of
from chauffeur.bench.lampilot.scenes.kinds import PAPER_FAMILIES, PAPER_ITEMS, PAPER_ROADS, PAPER_WORDS
from chauffeur.bench.lampilot.scenes.unambiguous import words_of
from chauffeur.bench.lampilot.scenes.wording_choice import form_of, normal
from chauffeur.worlds.highway.dblv1 import Dataset


@dataclass(frozen=True, slots=True)
class SceneStatistics:
    """Counts of Tab. III, and how much sentences repeat.

    Attributes:
        items: Number of items.
        scenes: Number of different samples.
        families: Items per family; `other` for what is not LaMPilot's.
        roads: Items per road, `highway` and `intersection`.
        words: Least, mean and greatest instruction length.
        sentences: Number of different instructions.
        forms: Number of different instructions when numbers are masked.
        most_repeated: How often the most repeated of these forms comes.
    """

    items: int
    scenes: int
    families: dict[str, int]
    roads: dict[str, int]
    words: tuple[int, float, int]
    sentences: int
    forms: int
    most_repeated: int


def statistics_of(datasets: Sequence[Dataset]) -> SceneStatistics:
    """Statistics over data sets together (the splits of a suite)."""
    items = [item for dataset in datasets for item in dataset.items()]
    families = Counter(family_of(item.task) for item in items)
    roads = Counter(
        "intersection" if item.scenario.config.get("type") == "dt-intersection-v0" else "highway" for item in items
    )
    lengths = [words_of(item.command) for item in items]
    forms = Counter(form_of(item.command) for item in items)
    return SceneStatistics(
        items=len(items),
        scenes=len({item.scenario.id for item in items}),
        families={family: families[family] for family in (*FAMILIES, "other") if families[family]},
        roads=dict(sorted(roads.items())),
        words=(min(lengths, default=0), sum(lengths) / max(1, len(lengths)), max(lengths, default=0)),
        sentences=len({normal(item.command) for item in items}),
        forms=len(forms),
        most_repeated=max(forms.values(), default=0),
    )


def table(ours: SceneStatistics) -> list[tuple[str, str, str]]:
    """Rows of Tab. III: name, here, paper."""

    def share(count: int, total: int) -> str:
        return f"{count:,} ({count / total:.1%})" if total else "0"

    rows = [("Total scenarios", share(ours.items, ours.items), share(PAPER_ITEMS, PAPER_ITEMS))]
    rows += [
        (family.capitalize(), share(ours.families.get(family, 0), ours.items), share(count, PAPER_ITEMS))
        for family, count in PAPER_FAMILIES.items()
    ]
    if ours.families.get("other"):
        rows.append(("Other", share(ours.families["other"], ours.items), "-"))
    rows += [
        (road.capitalize(), share(ours.roads.get(road, 0), ours.items), share(count, PAPER_ITEMS))
        for road, count in PAPER_ROADS.items()
    ]
    names = ("Minimum", "Average", "Maximum")
    rows += [
        (f"{name} instruction length, words", f"{value:.1f}" if name == "Average" else f"{value:.0f}", f"{paper:g}")
        for name, value, paper in zip(names, ours.words, PAPER_WORDS, strict=True)
    ]
    rows += [
        ("Different scenes", f"{ours.scenes:,}", "490"),
        ("Different instructions", f"{ours.sentences:,}", "-"),
        ("Different instructions, numbers masked", f"{ours.forms:,}", "-"),
        ("Most repeated of these", f"{ours.most_repeated:,}", "-"),
    ]
    return rows
