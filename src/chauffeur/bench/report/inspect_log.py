"""A run as a log of Inspect AI (`inspect view`): one sample an item, the drive's result as its score.

The log is put together as plain values, checked by Inspect's own types and written by its own writer. Inspect AI is an
extra: it is imported when a log is asked for.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import secrets
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.report import MEASURES, intervals
from chauffeur.bench.report.method import facts
from chauffeur.bench.report.model import SIMULATED
from chauffeur.bench.report.redrive import KeptDrive
from chauffeur.bench.report.runs import NOTHING_DRIVEN, Run
from chauffeur.bench.report.sentences import goal_words, happened
from chauffeur.bench.report.tables import RowSampling
from chauffeur.concept import ConfigError, DataError, MissingExtraError, Plan, Program, Scenario

SCORER = "lampilot"
FORMATS = (".eval", ".json")

_POINTS = ("ttc", "speed_variance", "time_efficiency")
_CAUSES = ("policy_failed", "infra_failed", "refused", "fallback_used")
_BESIDE = ("lane_ttc_s", "stop", "fault")


def write_inspect_log(path: Path, run: Run, how: RowSampling) -> Path:
    """Write a run as an Inspect log; the file appears whole or not at all.

    Args:
        path: `.eval` (zip) or `.json`.
        run: The run.
        how: How the intervals beside its metrics are made.

    Raises:
        ConfigError: The file's name ends otherwise.
        MissingExtraError: Inspect AI is not installed.
        DataError: The run's stages cannot be read, or the file cannot be written.
    """
    if path.suffix not in FORMATS:
        raise ConfigError(
            f"{path.name} is no name for an Inspect log.", hint=f"It ends in {' or '.join(FORMATS)}, e.g. run.eval."
        )
    library = _inspect()
    log = library.EvalLog.model_validate(log_content(run, how))
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


def log_content(run: Run, how: RowSampling) -> dict[str, Any]:
    """The log as JSON values, in the layout of Inspect's `EvalLog`, version 2.

    Raises:
        DataError: The run's stages cannot be read.
    """
    kept, scenes = KeptDrive(run), run.scenes
    identity = hashlib.sha256(json.dumps([run.plan, run.ruler], sort_keys=True).encode("utf-8", "replace")).hexdigest()
    # A run does not note when it was made; its results were last scored then.
    scored_at = datetime.fromtimestamp((run.folder / "results.jsonl").stat().st_mtime, tz=UTC).isoformat()
    return {
        "version": 2,
        "status": "success",
        "eval": {
            "eval_id": identity[:22],
            "run_id": identity[22:44],
            "created": scored_at,
            "task": "chauffeur/lampilot",
            "task_id": identity[44:],
            "task_version": run.ruler,
            "task_display_name": "LaMPilot-Bench",
            "task_args": {"metrics": run.ruler, "setting": run.config.get("setting", "")},
            "tags": [SIMULATED, *run.labels],
            "dataset": {
                "name": f"DbLv1 format, sha256 {run.data_sha256[:12]}",
                "samples": len(run.rows),
                "shuffled": False,
            },
            "model": str(run.rows[0].get("planner") or run.name),
            "config": {"epochs": 1},
            "packages": {name: str(number) for name, number in run.provenance.get("versions", {}).items()},
            "metadata": dict(facts(run, run.planned)),
        },
        "plan": {"name": "chauffeur", "steps": [{"solver": run.name}]},
        "results": _results(run, how),
        "stats": {"started_at": scored_at, "completed_at": scored_at},
        "samples": [_sample(run, row, kept.plan(row), kept, scenes.get(str(row["sample"]))) for row in run.rows],
    }


def _results(run: Run, how: RowSampling) -> dict[str, Any]:
    found = intervals(run.rows, draws=how.draws, seed=how.seed)
    metrics = {
        name: {
            "name": name,
            "value": found[name].value,
            "metadata": {"low_95": found[name].low, "high_95": found[name].high, "interval": found[name].how},
        }
        for name in MEASURES
        if found[name].value is not None
    }
    count = len(run.rows)
    return {
        "total_samples": count,
        "completed_samples": sum(not row["infra_failed"] for row in run.rows),
        "scores": [
            {
                "name": SCORER,
                "scorer": SCORER,
                "scored_samples": count,
                "unscored_samples": 0,
                "params": {"metrics": run.ruler},
                "metrics": metrics,
            }
        ],
    }


def _sample(run: Run, row: Row, plan: Plan | None, kept: KeptDrive, scene: Scenario | None) -> dict[str, Any]:
    context = kept.context(row)
    told = "" if context is None else f"{context.text}\n\n"
    messages = [{"role": "user", "content": f"{told}{row['command']}"}]
    sample: dict[str, Any] = {
        "id": str(row["item"]),
        "epoch": 1,
        "input": str(row["command"]),
        "target": "" if scene is None else goal_words(scene.goal),
        "messages": messages,
        "scores": {SCORER: _score(row)},
        "metadata": {
            "task": row["task"],
            "family": row["family"],
            "sample": row["sample"],
            "scenario_seed": str(row["scenario_seed"]),
            "intent": row.get("intent", ""),
            "simulated": True,
            "labels": list(run.labels),
            "latency_s": row.get("latency_s"),
            "cost_usd": row.get("cost_usd"),
        },
    }
    if plan is not None:
        reply = {"role": "assistant", "content": _reply(plan), "source": "generate"}
        messages.append(reply)
        output: dict[str, Any] = {
            "model": plan.model or plan.planner,
            "choices": [{"message": reply, "stop_reason": "stop"}],
            "time": plan.latency_s,
        }
        sample |= {"output": output, "total_time": plan.latency_s}
        tokens = plan.usage.prompt_tokens, plan.usage.completion_tokens
        if any(tokens):
            usage = {"input_tokens": tokens[0], "output_tokens": tokens[1], "total_tokens": sum(tokens)}
            output["usage"] = usage
            sample["model_usage"] = {plan.model or plan.planner: usage}
    if row["infra_failed"]:
        sample["error"] = {"message": str(row["detail"]), "traceback": "", "traceback_ansi": ""}
    return sample


def _reply(plan: Plan) -> str:
    parts = [plan.thoughts.text, plan.refusal]
    if isinstance(plan.policy, Program):
        parts.append(f"```python\n{plan.policy.source.rstrip()}\n```")
    return "\n\n".join(part for part in parts if part)


def _score(row: Row) -> dict[str, Any]:
    value: dict[str, Any] = {
        "success": bool(row["success"]),
        "collision": bool(row["collision"]),
        "score": float(row["score"] or 0.0),
    }
    if row["outcome"] not in NOTHING_DRIVEN:
        value |= {name: row[name] for name in _POINTS}
    return {
        "value": value,
        "answer": str(row["outcome"]),
        "explanation": " ".join(happened(row)),
        "metadata": {
            "outcome": row["outcome"],
            "steps": row.get("steps"),
            **{name: bool(row[name]) for name in _CAUSES},
            **{name: row[name] for name in _BESIDE if name in row},
        },
    }
