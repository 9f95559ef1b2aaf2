"""Run folders of any benchmark as values: read tolerantly, named apart, and cut to the items they have in common."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, cast, get_type_hints

from chauffeur.bench.kernel.benchmark import GROUP
from chauffeur.bench.kernel.metrics import TableSpec
from chauffeur.bench.kernel.stages import LIVE
from chauffeur.bench.kernel.store import Row, is_written, unseal
from chauffeur.concept import ChauffeurError, ConfigError, DataError
from chauffeur.concept.data import parse_json
from chauffeur.concept.registry import load_plugin, plugin_names
from chauffeur.planners.transcript import ModelTurn

_AGAIN = "Run the same chauffeur bench command again; it goes on where it stopped."

RunState = Literal["running", "unfinished", "finished"]


@dataclass(frozen=True, slots=True)
class Run:
    """One run; of one that goes on, or was killed, what it has done so far.

    Attributes:
        name: What the run is called in tables; unlike any other run's of the report.
        folder: Where it lies.
        bench: Id of its benchmark.
        rows: Its rows, in the plan's order.
        plan: Content of `plan.json`.
        provenance: Content of `provenance.json`; empty where there is none.
        stored: Content of `report.json`; empty where there is none.
        labels: What must be said wherever the run is shown, e.g. `critic: evaluator`.
        state: `running` while a process works in the folder, `unfinished` where items are missing and none does.
    """

    name: str
    folder: Path
    bench: str
    rows: tuple[Row, ...]
    plan: Row
    provenance: Row
    stored: Row
    labels: tuple[str, ...]
    state: RunState = "finished"

    @property
    def said(self) -> str:
        """The name with its labels."""
        return f"{self.name} [{'; '.join(self.labels)}]" if self.labels else self.name

    @property
    def planned(self) -> int:
        """Number of items the run was planned for; for a shard, of the whole run."""
        return int(self.plan.get("planned", len(self.plan["items"])))

    @property
    def done(self) -> int:
        """Number of items that have rows."""
        return len({row["item"] for row in self.rows})

    @property
    def config(self) -> Row:
        """Settings that decided the run."""
        return dict(self.plan.get("config", {}))

    @property
    def data(self) -> tuple[str, ...]:
        """Hashes of its data."""
        return tuple(str(value) for name, value in sorted(self.config.items()) if name.endswith("sha256"))

    @property
    def ruler(self) -> str:
        """Versioned id of the metrics its rows carry; empty where the benchmark has but one."""
        return str(self.rows[0].get("metrics", ""))

    def stage(self, name: str, key: str) -> dict[str, Row]:
        """Rows of a stage file, e.g. `generate` by `item`, the last row of a key winning; empty where there is none.

        The file is only read: a process that still appends to it is not disturbed, and a line that is damaged or not
        whole yet is left out.

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

    def turns(self, answer: Row, systems: Mapping[str, Row]) -> list[ModelTurn]:
        """The conversation that a row of `generate` keeps, in order; empty where no model was asked in words.

        Args:
            answer: The row.
            systems: Rows of the stage `systems` by `sha256`.
        """
        found: list[ModelTurn] = []
        for turn in answer.get("turns") or ():
            text = turn.get("text", "")
            if "sha256" in turn:
                text = (systems.get(str(turn["sha256"])) or {}).get("text", "The run did not keep this message.")
            found.append({"role": str(turn.get("role", "")), "text": str(text)})
        return found


def benchmark_kind(bench: str) -> Any:
    """The class of the benchmark with an id, out of those that are installed; None where it is not (any more)."""
    # Most ids begin with the name that the benchmark is registered under; only for the others are all imported.
    for name in sorted(plugin_names(GROUP), key=lambda name: (not bench.startswith(name), -len(name))):
        try:
            found: Any = load_plugin(GROUP, name)
        except ChauffeurError:
            continue  # a package that cannot be imported is none of this run's
        kind: Any = found if isinstance(found, type) else get_type_hints(found).get("return")
        for one in (kind, *getattr(kind, "__subclasses__", tuple)()):
            if getattr(one, "id", "") == bench:
                return one
    return None


def simulated(kind: Any) -> bool:
    """True if the figures of a class of benchmarks are results of drives; one that drives nothing says `drives = False`
    or asks for words."""
    return bool(getattr(kind, "drives", getattr(kind, "asks", "") != "words"))


def specs_of(kind: Any) -> tuple[TableSpec, ...]:
    """The tables that a class of benchmarks declares; none where they are made for each run."""
    found: Any = getattr(kind, "tables", ())
    return tuple(cast("Sequence[TableSpec]", found)) if isinstance(found, tuple | list) else ()


def load_runs(folders: Sequence[Path]) -> tuple[Run, ...]:
    """Read runs of one benchmark and give each a name of its own.

    Raises:
        ConfigError: No folder, one folder twice, or runs of several benchmarks or rulers.
        DataError: See load_run.
    """
    if not folders:
        raise ConfigError("No run folder was given.", hint="Name one or more, e.g. chauffeur report runs/lampilot-idm.")
    resolved = [folder.resolve() for folder in folders]
    twice = next((f for i, f in enumerate(resolved) if f in resolved[:i]), None)
    if twice is not None:
        raise ConfigError(f"The run folder {twice} was given twice.", hint="Name each run once.")
    runs = [load_run(folder) for folder in folders]
    if len(benches := dict.fromkeys(run.bench for run in runs)) > 1:
        raise ConfigError(
            f"These are runs of {' and '.join(benches)}, which no table holds together.",
            hint="Report each benchmark apart.",
        )
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


def load_run(folder: Path) -> Run:
    """Read one run folder of `chauffeur bench`.

    Raises:
        DataError: It is not one, has no results yet, or holds rows that are damaged or not its own.
    """
    if not folder.is_dir():
        raise DataError(f"No such run folder: {folder}.", hint="Make one with chauffeur bench NAME --out FOLDER.")
    if not (folder / "plan.json").is_file():
        raise DataError(
            f"{folder} is not a run folder: it has no plan.json.",
            hint="Give the folder that chauffeur bench wrote, e.g. runs/lampilot-onboard.",
        )
    plan = _json(folder / "plan.json")
    if not isinstance(plan.get("items"), list) or not plan["items"]:
        raise DataError(f"{folder / 'plan.json'} plans no items, so there is nothing to report.")
    items = [str(item) for item in plan["items"]]
    # What a run has done so far is newer than the results of an earlier start of it.
    path = next((folder / name for name in (LIVE, "results.jsonl") if (folder / name).is_file()), None)
    if path is None:
        raise DataError(f"The run in {folder} is not finished: it has no results.jsonl.", hint=_AGAIN)
    rows = _rows(path, items, torn=path.name == LIVE)
    state: RunState = "running" if is_written(folder) else "finished"
    if state == "finished" and (path.name == LIVE or len({row["item"] for row in rows}) < len(items)):
        state = "unfinished"
    provenance, stored = (
        _json(folder / name) if (folder / name).is_file() else {} for name in ("provenance.json", "report.json")
    )
    return Run(
        name=_name(rows[0], plan, folder),
        folder=folder,
        bench=str(plan.get("bench", "")),
        rows=rows,
        plan=plan,
        provenance=provenance,
        stored=stored,
        labels=tuple(dict.fromkeys(str(label) for row in rows for label in row.get("labels") or ())),
        state=state,
    )


def _rows(path: Path, planned: list[str], *, torn: bool) -> tuple[Row, ...]:
    """Rows of a file, in the plan's order; those of an item's last line where it may be `torn`, rows by item."""
    place = {item: number for number, item in enumerate(planned)}
    lines: dict[str, list[Row]] = {}
    for number, line in enumerate(_text(path).split("\n"), start=1):
        if not line.strip():
            continue
        try:
            row: Any = parse_json(line)
            item = str(row["item"])
            mine: list[Row] = [one | {"item": item} for one in row["rows"]] if torn else [row]
        except (ValueError, TypeError, KeyError) as error:
            if torn:
                continue
            raise DataError(
                f"{path}, line {number}, is no row of results ({type(error).__name__}: {error}).", hint=_AGAIN
            ) from error
        if item not in place:
            raise DataError(
                f"{path} has a row for {item}, which this run never planned.",
                hint="Rows of several runs seem mixed in one folder; score each run in its own.",
            )
        lines[item] = mine if torn else [*lines.get(item, ()), *mine]
    found = [row for mine in lines.values() for row in mine]
    if not found:
        raise DataError(f"{path} holds no row, so there is nothing to report.", hint=_AGAIN)
    if len(rulers := {str(row.get("metrics", "")) for row in found}) > 1:
        raise DataError(f"{path} mixes several rulers: {', '.join(sorted(rulers))}.", hint="Score it under one.")
    return tuple(sorted(found, key=lambda row: place[str(row["item"])]))


def _name(row: Row, plan: Row, folder: Path) -> str:
    """The planner, and its prompt setting where the planner is a language model."""
    config: Row = plan.get("config", {})
    named = (row.get("planner"), row.get("driver"), config.get("planner"))
    planner = next((name for name in named if isinstance(name, str) and name), folder.resolve().name)
    setting = str(config.get("setting", ""))
    # Only planners of the form `kind/model` read the system message that the setting is about.
    return f"{planner} ({setting})" if setting and "/" in planner and not planner.startswith("replay/") else planner


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


RowKey = tuple[str, ...]


def keyed(run: Run, *, same_data: bool) -> dict[RowKey, Row]:
    """A run's rows by what makes two rows of different runs the same: their item and their number within it; where the
    data's hashes differ, also the scene's seed and the words."""
    numbers: Counter[str] = Counter()
    found: dict[RowKey, Row] = {}
    for row in run.rows:
        item = str(row["item"])
        more = () if same_data else (str(row.get("scenario_seed", "")), str(row.get("command", "")))
        found[(item, str(numbers[item]), *more)] = row
        numbers[item] += 1
    return found


def on_common_items(runs: Sequence[Run]) -> tuple[tuple[Run, ...], str]:
    """Runs cut to the rows all of them have, in the first run's order, and what was cut, in words; with nothing in
    common every `rows` is empty."""
    same_data = len({run.data for run in runs}) == 1
    by_key = [keyed(run, same_data=same_data) for run in runs]
    common = [key for key in by_key[0] if all(key in rows for rows in by_key)]
    cut = tuple(replace(run, rows=tuple(rows[key] for key in common)) for run, rows in zip(runs, by_key, strict=True))
    if all(len(run.rows) == len(common) for run in runs):
        return cut, ""
    sizes = ", ".join(f"{run.name} {len(run.rows):,}" for run in runs)
    data = "" if same_data else " Their data sets differ; items count as the same when id, seed and command agree."
    return cut, f"The runs cover different items ({sizes}); {len(common):,} rows are in all of them.{data}"
