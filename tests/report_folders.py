"""Run folders written by hand, with every kind of row a report has to cope with. No simulator is needed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from chauffeur.driving.judge.metrics import points

HOSTILE = "</script><img src=x onerror=alert(1)> & \u2028 '\" | _x_ $100% #1 {\\cmd} ~^ <!-- \ud800"

PROGRAM = """def go():
    while True:
        yield autopilot()
"""


def signals(**more: Any) -> dict[str, Any]:
    """Signals of a smooth drive of 20 s."""
    return {
        "steps": 200,
        "ttc_along_s": 1.0,
        "ttc_plane_s": 0.5,
        "ttc_lane_s": 4.0,
        "speed_mean_mps": 25.0,
        "speed_std_mps": 2.0,
        "crashed": False,
        "off_road": False,
        "past_end": False,
        "stop_speed_mps": None,
        "fault": "",
    } | more


def outcome(kind: str = "success", **more: Any) -> dict[str, Any]:
    """What happened, as a rollout row has it."""
    crashed = kind == "collision"
    base: dict[str, Any] = {
        "outcome": kind,
        "success": kind == "success",
        "steps": 0 if kind in ("refused", "not_driven") else 200,
        "signals": None
        if kind in ("refused", "not_driven")
        else signals(crashed=crashed, off_road=kind == "off_road", fault="ego" if crashed else ""),
        "policy_failed": False,
        "infra_failed": kind == "not_driven",
        "refused": kind == "refused",
        "fallback_used": False,
        "detail": "",
    }
    return base | more


def write_run(
    folder: Path,
    outcomes: list[list[dict[str, Any]]],
    *,
    planner: str = "onboard",
    ruler: str = "lampilot-origin-v1",
    labels: tuple[str, ...] = (),
    data: str = "d" * 64,
    families: tuple[str, ...] = ("distance", "routing"),
    command: str = "Go on.",
    thoughts: str = "I go on.",
    row: dict[str, Any] | None = None,
    setting: str = "few-shot",
) -> Path:
    """A finished run: `outcomes[scene][command]`. Scenes take the families in turn."""
    folder.mkdir(parents=True)
    items: list[str] = []
    results: list[dict[str, Any]] = []
    stages: dict[str, list[dict[str, Any]]] = {"contexts": [], "generate": [], "rollout": []}
    for scene, drives in enumerate(outcomes):
        sample = f"task{scene % 3}_s{scene}"
        stages["contexts"].append({"sample": sample, "context": None, "error": ""})
        for number, drive in enumerate(drives):
            item = f"{sample}_c{number}"
            items.append(item)
            plan = {
                "thoughts": {"text": thoughts},
                "policy": {"source": PROGRAM, "kind": "program"},
                "planner": planner,
                "model": "m-1",
                "usage": {"prompt_tokens": 100, "completion_tokens": 10},
                "latency_s": 0.5 + number,
            }
            stages["generate"].append({"item": item, "plan": plan, "error": ""})
            stages["rollout"].append({"key": item, "sample": sample, "verdicts": [], **drive})
            results.append(
                {
                    "schema": "lampilot-results-v2",
                    "planner": planner,
                    "model": "m-1",
                    "data_sha256": data,
                    "chauffeur": "0.1.0",
                    "labels": list(labels),
                    "item": item,
                    "task": f"task{scene % 3}",
                    "family": families[scene % len(families)],
                    "sample": sample,
                    "scenario_seed": str(scene),
                    "command": command,
                    "latency_s": 0.5 + number,
                    "prompt_tokens": 100,
                    "completion_tokens": 10,
                    "cost_usd": None,
                    "rollout_key": item,
                    "intent": "",
                    **{name: value for name, value in drive.items() if name != "signals"},
                    **points(drive, ruler),
                    **(row or {}),
                }
            )
    config = {"planner": planner, "setting": setting, "data_sha256": data, "items": 0, "seed": 42}
    write(folder / "plan.json", {"bench": "lampilot-bench-v2", "config": config, "model": "m-1", "items": items})
    versions = {"chauffeur": "0.1.0", "numpy": "2"}
    write(folder / "provenance.json", {"bench": "lampilot-bench-v2", "python": "3.11", "versions": versions})
    for name, rows in stages.items():
        write_lines(folder / f"{name}.jsonl", rows)
    write_lines(folder / "results.jsonl", results)
    return folder


def write(path: Path, value: Any) -> None:
    """JSON, lone surrogates and all."""
    path.write_bytes(json.dumps(value, ensure_ascii=False).encode("utf-8", "surrogatepass"))


def write_lines(path: Path, rows: list[dict[str, Any]]) -> None:
    """JSON lines."""
    text = "".join(json.dumps(row, ensure_ascii=False) + "\n" for row in rows)
    path.write_bytes(text.encode("utf-8", "surrogatepass"))


def read_lines(path: Path) -> list[dict[str, Any]]:
    """JSON lines back."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8", errors="replace").splitlines()]


def mixed(scenes: int = 12, commands: int = 2) -> list[list[dict[str, Any]]]:
    """Half done, and every kind of failure."""
    kinds = ("failure", "timeout", "collision", "off_road", "refused", "not_driven")
    return [
        [outcome("success" if scene % 2 == 0 else kinds[(scene // 2) % len(kinds)]) for _ in range(commands)]
        for scene in range(scenes)
    ]
