"""The score stage: from what was asked and what happened to one row per planned item, under one ruler.

It reads stored rows only, so it costs neither a token nor a simulation: another ruler is another scoring.
"""

from __future__ import annotations

import json
from importlib.metadata import version
from pathlib import Path

from chauffeur.bench.kernel.report import fill, markdown
from chauffeur.bench.kernel.run import as_json, write_results
from chauffeur.bench.kernel.stages import StageStore
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.benchmark import LampilotBenchmark
from chauffeur.bench.lampilot.frozen import Frozen
from chauffeur.bench.lampilot.report import FAMILY_TABLE, JUDGE, TABLES, answers_note
from chauffeur.bench.lampilot.rollout import ROLLOUT_VERSION
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import Item

SCHEMA = "lampilot-results-v2"


def open_stages(folder: Path, frozen: Frozen) -> StageStore[Item]:
    """Read a run folder's stages. Raises StorageError."""
    return StageStore[Item].open(folder, LampilotBenchmark(frozen), frozen)


def results(stages: StageStore[Item], ruler: str) -> list[Row]:
    """One row per planned item.

    Args:
        stages: What was asked and what happened.
        ruler: Short name or id of a ruler.

    Raises:
        ConfigError: There is no such ruler.
    """
    frozen = stages.manifest
    assert isinstance(frozen, Frozen)
    scorer = LampilotBenchmark(frozen, ruler=ruler)
    about = about_rows(frozen, scorer.ruler)
    return [about | row for item in frozen.items for row in scorer.rows(stages.outcome(item))]


def about_rows(frozen: Frozen, ruler: str) -> Row:
    """Fields of a run that stand in every row; `ruler` is a ruler's id."""
    return {
        "schema": SCHEMA,
        "metrics": ruler,
        "planner": frozen.config["planner"],
        "model": frozen.model,
        "data_sha256": frozen.config["data_sha256"],
        "chauffeur": version("chauffeur"),
        "labels": list(frozen.labels),
    }


def publish_results(folder: Path, stages: StageStore[Item], rows: list[Row]) -> None:
    """Write `results.jsonl`, `provenance.json`, `report.json` and `table.md`. Raises DataError."""
    missing = sum(not stages.asked(item) for item in stages.manifest.items)
    notes = [*stages.manifest.labels, f"metrics {rows[0]['metrics']}"] if rows else []
    if answers := answers_note(rows):
        notes.append(answers)
    if missing:
        notes.append(f"partial: {missing} of {len(rows)} items have not been asked and count as not driven")
    filled = fill(FAMILY_TABLE, rows)
    table = markdown(filled.header, filled.cells) if rows else "No items."
    told = {"bench": stages.manifest.bench, "judge": JUDGE, "tables": [fill(spec, rows).json for spec in TABLES]}
    write_results(
        folder,
        {
            "results.jsonl": "".join(json.dumps(row, ensure_ascii=False) + "\n" for row in rows),
            "provenance.json": as_json(stages.manifest.provenance(rollout=ROLLOUT_VERSION, engine=HighwayWorld.engine)),
            "report.json": as_json(told),
            "table.md": f"{', '.join(notes)}\n\n{table}\n",
        },
    )
