"""Finished run folders as values: read tolerantly, checked for being whole, brought under one ruler and onto the same
items before they are compared."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, cast

from chauffeur.bench.kernel.store import Row, unseal
from chauffeur.bench.lampilot.benchmark import NOT_ASKED
from chauffeur.bench.lampilot.metrics import ORIGIN
from chauffeur.concept import ConfigError, DataError, Scenario
from chauffeur.concept.data import parse_json

NOTHING_DRIVEN = ("refused", "not_driven")
"""Outcomes of items without a drive; no ruler has anything to measure there."""

SCHEMAS = ("lampilot-results-v1", "lampilot-results-v2")

_NEEDED = ("item", "family", "sample", "command", "outcome", "success", "collision", "score")
_UNKNOWN: Row = {
    "scenario_seed": "",
    "task": "",
    "ttc": None,
    "speed_variance": None,
    "time_efficiency": None,
    "policy_failed": False,
    "infra_failed": False,
    "refused": False,
    "fallback_used": False,
    "detail": "",
}


@dataclass(frozen=True, slots=True)
class Run:
    """One finished run.

    Attributes:
        name: What the run is called in tables; unlike any other run's of the report.
        folder: Where it lies.
        ruler: Versioned id of the metrics its rows carry.
        rows: One per planned item, in the plan's order.
        plan: Content of `plan.json`.
        provenance: Content of `provenance.json`; empty where there is none.
        labels: What must be said wherever the run is shown, e.g. `critic: evaluator`.
    """

    name: str
    folder: Path
    ruler: str
    rows: tuple[Row, ...]
    plan: Row
    provenance: Row
    labels: tuple[str, ...]

    @property
    def planned(self) -> int:
        """How many items the run was planned for; of a shard, the whole run's."""
        return int(self.plan.get("planned", len(self.plan["items"])))

    @property
    def not_asked(self) -> int:
        """Items that the run stopped before, e.g. because a budget was spent; their rows say so."""
        return sum(row["detail"] == NOT_ASKED for row in self.rows)

    @property
    def scenes(self) -> dict[str, Scenario]:
        """Scenes by sample; empty where the run kept none (versions before 2 of the plan).

        Raises:
            DataError: The plan's scenes are damaged.
        """
        try:
            return {name: Scenario(**fields) for name, fields in self.plan.get("samples", {}).items()}
        except (TypeError, AttributeError) as error:
            raise DataError(f"The scenes in {self.folder / 'plan.json'} are damaged: {error}.") from error

    @property
    def config(self) -> Row:
        """What decided the run."""
        return dict(self.plan.get("config", {}))

    @property
    def data_sha256(self) -> str:
        """Hash of its data set; empty when its rows do not name one."""
        return str(self.rows[0].get("data_sha256", ""))

    def stage(self, name: str, key: str) -> dict[str, Row]:
        """Rows of a stage file, e.g. `generate` by `item`, the last row of a key winning; empty where there is none.

        The file is only read: whoever may still be appending to it is not disturbed, and a line that is damaged or
        not whole yet is left out.

        Raises:
            DataError: The file cannot be read.
        """
        path = self.folder / f"{name}.jsonl"
        found: dict[str, Row] = {}
        for line in _content(path).split(b"\n") if path.is_file() else ():
            with contextlib.suppress(ValueError, KeyError, TypeError):
                row = unseal(line)
                found[str(row[key])] = row
        return found


def load_runs(folders: Sequence[Path]) -> tuple[Run, ...]:
    """Read runs and give each a name of its own.

    Raises:
        ConfigError: No folder, or one folder twice.
        DataError: See load_run.
    """
    if not folders:
        raise ConfigError("No run folder was given.", hint="Name one or more, e.g. chauffeur report runs/lampilot-idm.")
    resolved = [folder.resolve() for folder in folders]
    twice = next((f for i, f in enumerate(resolved) if f in resolved[:i]), None)
    if twice is not None:
        raise ConfigError(f"The run folder {twice} was given twice.", hint="Name each run once.")
    runs = [load_run(folder) for folder in folders]
    names = [run.name for run in runs]
    return tuple(
        replace(run, name=f"{run.name} ({_short(folder, resolved)})") if names.count(run.name) > 1 else run
        for run, folder in zip(runs, resolved, strict=True)
    )


def _short(folder: Path, folders: Sequence[Path]) -> str:
    """The folder's own name, with as many parents as tell it from the others."""
    for parts in range(1, len(folder.parts)):
        name = folder.parts[-parts:]
        if sum(other.parts[-parts:] == name for other in folders) == 1:
            return "/".join(name)
    return str(folder)


_LAMPILOT: Final = "lampilot-bench"


def tables_of_another(folder: Path) -> str:
    """The tables that a finished run of another benchmark wrote, as Markdown; empty for a run of LaMPilot-Bench.

    Raises:
        DataError: It is no run folder that can be read.
    """
    if not (folder / "plan.json").is_file():
        return ""
    bench = str(_json(folder / "plan.json").get("bench", _LAMPILOT))
    table = folder / "table.md"
    return "" if bench.startswith(_LAMPILOT) or not table.is_file() else _text(table)


def load_run(folder: Path) -> Run:
    """Read one run folder of `chauffeur bench lampilot`.

    Raises:
        DataError: It is not one, is not finished, or holds rows that are damaged, of a newer version, or not its own.
    """
    if not folder.is_dir():
        raise DataError(f"No such run folder: {folder}.", hint="Make one with chauffeur bench lampilot --out FOLDER.")
    if not (folder / "plan.json").is_file():
        raise DataError(
            f"{folder} is not a run folder: it has no plan.json.",
            hint="Give the folder that chauffeur bench lampilot wrote, e.g. runs/lampilot-onboard.",
        )
    plan = _json(folder / "plan.json")
    bench = str(plan.get("bench", _LAMPILOT))
    if not bench.startswith(_LAMPILOT):
        raise DataError(
            f"{folder} holds a run of {bench}; a report is made of runs of LaMPilot-Bench.",
            hint=f"Its tables are in {folder / 'table.md'}, its figures with intervals in report.json beside it.",
        )
    if not isinstance(plan.get("items"), list) or not plan["items"]:
        raise DataError(f"{folder / 'plan.json'} plans no items, so there is nothing to report.")
    if not (folder / "results.jsonl").is_file():
        raise DataError(
            f"The run in {folder} is not finished: {_progress(folder, len(plan['items']))}.",
            hint="Run the same chauffeur bench lampilot command again; it goes on where it stopped.",
        )
    rows = _rows(folder, plan["items"])
    provenance = folder / "provenance.json"
    return Run(
        name=_name(rows[0], plan),
        folder=folder,
        ruler=_only(folder, rows, "metrics", ORIGIN.id),
        rows=rows,
        plan=plan,
        provenance=_json(provenance) if provenance.is_file() else {},
        labels=tuple(dict.fromkeys(str(label) for row in rows for label in row.get("labels") or ())),
    )


def _rows(folder: Path, items: list[Any]) -> tuple[Row, ...]:
    path = folder / "results.jsonl"
    by_item: dict[str, Row] = {}
    for number, line in enumerate(_text(path).split("\n"), start=1):
        if not line.strip():
            continue
        row = _row(path, number, line)
        by_item[str(row["item"])] = _UNKNOWN | row
    planned = [str(item) for item in items]
    missing = [item for item in planned if item not in by_item]
    if missing:
        raise DataError(
            f"{path} has rows for {len(planned) - len(missing)} of {len(planned)} planned items; "
            f"{missing[0]} is the first without one.",
            hint="Run the same chauffeur bench lampilot command again; it goes on where it stopped.",
        )
    foreign = next(iter(by_item.keys() - set(planned)), None)
    if foreign is not None:
        raise DataError(
            f"{path} has a row for {foreign}, which this run never planned.",
            hint="Rows of several runs seem mixed in one folder; score each run in its own.",
        )
    return tuple(by_item[item] for item in planned)


def _row(path: Path, number: int, line: str) -> Row:
    try:
        row: Any = parse_json(line)
    except ValueError as error:
        raise DataError(
            f"{path}, line {number}, is not JSON: {error}.", hint="Score the run again to write the file anew."
        ) from error
    schema = row.get("schema") if isinstance(row, dict) else None
    if schema not in SCHEMAS:
        raise DataError(
            f"{path}, line {number}, has the schema {schema!r}, which this version cannot read.",
            hint=f"It reads {' and '.join(SCHEMAS)}; a newer chauffeur may have written the run.",
        )
    absent = [name for name in _NEEDED if name not in row]
    if absent:
        raise DataError(f"{path}, line {number}, lacks {', '.join(absent)}.", hint="Score the run again.")
    return cast("Row", row)


def _only(folder: Path, rows: tuple[Row, ...], column: str, default: str) -> str:
    found = {str(row.get(column, default)) for row in rows}
    if len(found) > 1:
        raise DataError(
            f"{folder / 'results.jsonl'} mixes several {column}: {', '.join(sorted(found))}.",
            hint="Score the run again under one.",
        )
    return found.pop()


def _name(row: Row, plan: Row) -> str:
    """The planner, and its prompt setting where the planner is a language model."""
    planner = str(row.get("planner") or plan.get("config", {}).get("planner") or "unnamed planner")
    setting = str(plan.get("config", {}).get("setting", ""))
    # Only planners of the form `kind/model` read the system message that the setting is about.
    return f"{planner} ({setting})" if setting and "/" in planner and not planner.startswith("replay/") else planner


def _progress(folder: Path, items: int) -> str:
    plans, drives = folder / "generate.jsonl", folder / "rollout.jsonl"
    parts = [
        f"{_text(path).count(chr(10))} {what}"
        for path, what in ((plans, "plans made"), (drives, "drives made"))
        if path.is_file()
    ]
    return f"{items} items planned, {', '.join(parts) or 'nothing made yet'}, no results.jsonl"


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise DataError(f"Cannot read {path}: {error.strerror or error}.", hint="Restore the file.") from error


def _text(path: Path) -> str:
    # A foreign planner's words may hold lone surrogates; they are shown as replacement characters.
    return _content(path).decode("utf-8", "replace")


def _json(path: Path) -> Row:
    try:
        value: Any = parse_json(_text(path))
    except ValueError as error:
        raise DataError(f"{path} is not JSON: {error}.", hint="Restore the file, or start in a new folder.") from error
    if not isinstance(value, dict):
        raise DataError(f"{path} does not hold an object.", hint="Restore the file, or start in a new folder.")
    return cast("Row", value)


ItemKey = tuple[str, str, str]


def item_key(row: Row, *, same_data: bool) -> ItemKey:
    """What makes two rows of different runs the same item: its id, and, where the data sets' hashes differ, also the
    scene's seed and the words."""
    item = str(row["item"])
    return (item, "", "") if same_data else (item, str(row["scenario_seed"]), str(row["command"]))


@dataclass(frozen=True, slots=True)
class Shared:
    """Runs cut to the items they have in common.

    Attributes:
        runs: The same runs, in the same order, rows in the first run's order.
        note: What was cut, in words; empty when nothing was.
    """

    runs: tuple[Run, ...]
    note: str


def on_common_items(runs: Sequence[Run]) -> Shared:
    """Cut runs to the items all of them have. With nothing in common every `rows` is empty."""
    same_data = len({run.data_sha256 for run in runs}) == 1
    tables = [{item_key(row, same_data=same_data): row for row in run.rows} for run in runs]
    common = [key for key in tables[0] if all(key in table for table in tables)]
    cut = tuple(replace(run, rows=tuple(table[k] for k in common)) for run, table in zip(runs, tables, strict=True))
    if all(len(run.rows) == len(common) for run in runs):
        return Shared(cut, "")
    sizes = ", ".join(f"{run.name} {len(run.rows):,}" for run in runs)
    data = "" if same_data else " Their data sets differ; items count as the same when id, seed and command agree."
    return Shared(cut, f"The runs cover different items ({sizes}); {len(common):,} are in all of them.{data}")
