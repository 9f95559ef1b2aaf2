"""A run of any benchmark as a log of Inspect AI (`inspect view`): one sample a row, what its rates say as its score.

The log is put together as plain values, checked by Inspect's own types and written by its own writer. Inspect AI is an
extra: it is imported when a log is asked for.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import secrets
from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from chauffeur.bench.kernel.metrics import AnyRow, TableSpec
from chauffeur.bench.kernel.report import fill
from chauffeur.bench.report.model import SIMULATED, asked_words, ending_words
from chauffeur.bench.report.runs import Run, specs_of
from chauffeur.concept import ConfigError, DataError, MissingExtraError

FORMATS = (".eval", ".json")


def write_inspect_log(path: Path, run: Run, kind: Any) -> Path:
    """Write a run as an Inspect log; the file appears whole or not at all.

    Args:
        path: `.eval` (zip) or `.json`.
        run: The run.
        kind: Class of its benchmark.

    Raises:
        ConfigError: The file's name ends otherwise, or the benchmark declares no tables.
        MissingExtraError: Inspect AI is not installed.
        DataError: The run's stages cannot be read, or the file cannot be written.
    """
    if path.suffix not in FORMATS:
        raise ConfigError(
            f"{path.name} is no name for an Inspect log.", hint=f"It ends in {' or '.join(FORMATS)}, e.g. run.eval."
        )
    spec = next((spec for spec in specs_of(kind) if spec.over is None), None)
    if spec is None:
        raise ConfigError(f"The metrics of {run.bench} are not at hand.", hint="Install the package that it is of.")
    library = _inspect()
    log = library.EvalLog.model_validate(log_content(run, spec))
    partial = path.with_name(f".{secrets.token_hex(4)}.{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        library.write_eval_log(log, str(partial))
        partial.replace(path)
    except OSError as error:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
        raise DataError(
            f"The Inspect log cannot be written to {path}: {error.strerror or error}.", hint="Choose another folder."
        ) from error
    return path


def _inspect() -> Any:
    try:
        return importlib.import_module("inspect_ai.log")
    except ImportError as error:
        raise MissingExtraError("An Inspect log needs Inspect AI, which is not installed.", extra="inspect") from error


def log_content(run: Run, spec: TableSpec) -> dict[str, Any]:
    """The log as JSON values, in the layout of Inspect's `EvalLog`, version 2; its metrics are a table's totals.

    Raises:
        DataError: The run's stages cannot be read.
    """
    plans = run.stage("generate", "item")
    identity = hashlib.sha256(json.dumps([run.plan, run.ruler], sort_keys=True).encode("utf-8", "replace")).hexdigest()
    # A run does not note when it was made; its results were last scored then.
    scored_at = datetime.fromtimestamp((run.folder / "results.jsonl").stat().st_mtime, tz=UTC).isoformat()
    rows = [row for row in run.rows if spec.rows(row)]
    return {
        "version": 2,
        "status": "success",
        "eval": {
            "eval_id": identity[:22],
            "run_id": identity[22:44],
            "created": scored_at,
            "task": f"chauffeur/{run.bench}",
            "task_id": identity[44:],
            "task_version": run.ruler or run.bench,
            "task_args": dict(run.config),
            "tags": [SIMULATED, *run.labels],
            "dataset": {"name": ", ".join(run.data) or run.bench, "samples": len(rows), "shuffled": False},
            "model": str(rows[0].get("planner") or run.name),
            "config": {"epochs": 1},
            "packages": {name: str(number) for name, number in run.provenance.get("versions", {}).items()},
        },
        "plan": {"name": "chauffeur", "steps": [{"solver": run.name}]},
        "results": _results(run, spec, rows),
        "stats": {"started_at": scored_at, "completed_at": scored_at},
        "samples": [_sample(run, spec, row, n, plans.get(str(row["item"])) or {}) for n, row in enumerate(rows)],
    }


def _results(run: Run, spec: TableSpec, rows: Sequence[AnyRow]) -> dict[str, Any]:
    line = fill(spec, rows).lines[-1]
    metrics = {
        measure.id: {
            "name": measure.id,
            "value": one.value,
            "metadata": {"low_95": one.low, "high_95": one.high, "interval": one.how, "unit": measure.unit},
        }
        for measure, one in zip(spec.measures, line.found, strict=True)
        if one.value is not None
    }
    about = {"name": run.bench, "scorer": run.bench, "scored_samples": len(rows), "unscored_samples": 0}
    return {
        "total_samples": len(rows),
        "completed_samples": sum(not row.get("infra_failed") for row in rows),
        "scores": [{**about, "params": {"metrics": run.ruler}, "metrics": metrics}],
    }


def _sample(run: Run, spec: TableSpec, row: AnyRow, number: int, stored: dict[str, Any]) -> dict[str, Any]:
    messages = [{"role": "user", "content": asked_words(row)}]
    found = {measure.id: measure.of(row) for measure in spec.measures}
    sample: dict[str, Any] = {
        "id": f"{row['item']}#{number}",
        "epoch": 1,
        "input": asked_words(row),
        "target": "",
        "messages": messages,
        "scores": {
            run.bench: {
                "value": {id: values[0] for id, values in found.items() if values is not None},
                "answer": ending_words(row),
                "explanation": str(row.get("detail") or ""),
            }
        },
        "metadata": dict(row),
    }
    plan = stored.get("plan") or {}
    if reply := _reply(plan):
        model = str(plan.get("model") or plan.get("planner") or run.name)
        said = {"role": "assistant", "content": reply, "source": "generate"}
        messages.append(said)
        output: dict[str, Any] = {"model": model, "choices": [{"message": said, "stop_reason": "stop"}]}
        sample["output"] = output
        usage: dict[str, int] = plan.get("usage") or {}
        tokens = int(usage.get("prompt_tokens") or 0), int(usage.get("completion_tokens") or 0)
        if any(tokens):
            counted = {"input_tokens": tokens[0], "output_tokens": tokens[1], "total_tokens": sum(tokens)}
            output["usage"] = counted
            sample["model_usage"] = {model: counted}
    if row.get("infra_failed"):
        sample["error"] = {"message": str(row.get("detail") or ""), "traceback": "", "traceback_ansi": ""}
    return sample


def _reply(plan: dict[str, Any]) -> str:
    """Text of the answer in a stored plan or stored words."""
    policy: Any = plan.get("policy") or {}
    source = policy.get("source", "") if isinstance(policy, dict) else ""
    parts = [(plan.get("thoughts") or {}).get("text", ""), plan.get("refusal", ""), plan.get("text", "")]
    if source:
        parts.append(f"```python\n{source.rstrip()}\n```")
    return "\n\n".join(part for part in parts if part)
