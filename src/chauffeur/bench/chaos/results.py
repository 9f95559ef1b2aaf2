"""What a run leaves behind beside its cases: the table as Markdown and as JSON, and what they rest on."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from chauffeur.bench.chaos.cases import SUITE_VERSION
from chauffeur.bench.chaos.runner import ChaosConfig
from chauffeur.bench.chaos.table import failures, figures, headline, table_markdown
from chauffeur.bench.kernel.store import Row
from chauffeur.drive.files import publish
from chauffeur.worlds.highway import HighwayWorld

_PACKAGES: Final = ("chauffeur", "numpy", "numba", "pydantic-monty", "httpx")


def write_results(folder: Path, config: ChaosConfig, rows: Sequence[Row]) -> None:
    """Write `table.md`, `table.json` and `provenance.json`. Raises DataError when they cannot be written."""
    table = {"headline": headline(rows), "figures": figures(rows), "failures": failures(rows)}
    for name, content in (
        ("table.md", table_markdown(rows, f"Faults, {SUITE_VERSION}")),
        ("table.json", json.dumps(table | provenance(config), indent=1) + "\n"),
        ("provenance.json", json.dumps(provenance(config), indent=1) + "\n"),
    ):
        publish(folder / name, content.encode(), "table")


def provenance(config: ChaosConfig) -> dict[str, Any]:
    """What a result rests on."""
    return {
        "suite": SUITE_VERSION,
        "config": asdict(config),
        "versions": {name: version(name) for name in _PACKAGES},
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} CPUs",
        "engine": HighwayWorld.engine,
        "note": "simulated drives (highway-env physics); real processes, faults injected from the outside",
    }
