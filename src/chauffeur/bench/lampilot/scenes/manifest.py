"""What a suite says about itself: numbers, rejections, words, hashes. No clock, no machine: same seed, same bytes."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from typing import Any

from chauffeur.bench.lampilot.scenes.annotations import FILE
from chauffeur.bench.lampilot.scenes.kinds import KINDS, MAIN
from chauffeur.bench.lampilot.scenes.statistics import statistics_of
from chauffeur.bench.lampilot.scenes.writer import SceneItem
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import Dataset

_SPLITS = ("train", "val", "test")


def manifest_of(
    rows: Sequence[Mapping[str, Any]], items: Sequence[SceneItem], datasets: Mapping[str, Dataset]
) -> dict[str, Any]:
    """Manifest of a written suite.

    Args:
        rows: Made items, in the order of the plan.
        items: The same as they were written.
        datasets: Folders as they read back, by name within the suite.
    """
    main = [datasets[name] for name in _SPLITS if name in datasets]
    return {
        "versions": {name: version(name) for name in ("chauffeur", "numpy")},
        "engine": HighwayWorld.engine,
        "items": {name: len(dataset.items()) for name, dataset in datasets.items()},
        "statistics": asdict(statistics_of(main)),
        "phrasing": dict(sorted(Counter(item.note.phrasing or "extras" for item in items).items())),
        "right_answers": dict(sorted(Counter(item.note.right for item in items).items())),
        "units": dict(sorted(Counter(item.note.unit or "none" for item in items).items())),
        "scenes": _scenes(rows),
        "words": _words(rows),
        "sha256": {
            name: {
                "tasks": dataset.sha256,
                "annotations": hashlib.sha256((dataset.path / FILE).read_bytes()).hexdigest(),
            }
            for name, dataset in datasets.items()
        },
    }


def _scenes(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Draws and rejections: of the main suite, of the extras, and by kind."""
    main = {kind.name for kind in MAIN}
    by_kind: dict[str, Counter[str]] = {}
    kept: Counter[str] = Counter(row["kind"] for row in rows)
    for row in rows:
        by_kind.setdefault(row["kind"], Counter()).update(row["rejected"])
    total: Counter[str] = Counter()
    for kind, why in by_kind.items():
        if kind in main:
            total.update(why)
    return {
        "main": {
            "kept": sum(kept[kind] for kind in main),
            "drawn": sum(kept[kind] for kind in main) + total.total(),
            "rejected": dict(total.most_common()),
            "solved_by": dict(Counter(row["solved_by"] for row in rows if row["kind"] in main).most_common()),
        },
        "by_kind": {
            kind: {"kept": kept[kind], "drawn": kept[kind] + why.total(), "rejected": dict(why.most_common())}
            for kind, why in by_kind.items()
        },
    }


def _words(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Wordings drawn and thrown away because they were read as something else, by family."""
    said: Counter[str] = Counter()
    misread: dict[str, Counter[str]] = {}
    for row in rows:
        family = KINDS[row["kind"]].family
        said[family] += row["said"]
        misread.setdefault(family, Counter()).update(row["misread"])
    return {
        family: {
            "drawn": said[family],
            "rejected": misread[family].total(),
            "rejected_share": round(misread[family].total() / max(1, said[family]), 4),
            "why": dict(misread[family].most_common()),
        }
        for family in said
    }
