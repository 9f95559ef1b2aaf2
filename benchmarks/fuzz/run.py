"""Coverage-guided fuzzing of one target, or of all.

    python benchmarks/fuzz/run.py --target gate --executions 100000 --seed 1 [--out DIR]

Needs atheris (`pip install atheris`). The corpus is kept in the folder of `--out` and gone on with by the next run. The
result is written as JSON to `OUT/TARGET/result.json`: executions, findings, crashes, what became of the inputs, covered
edges, versions. `--replay FILE` gives one input to a target and says what became of it; it needs no atheris.

A finding is an input for which the target's invariant does not hold; the process goes on after it. A crash is an input
that took the process down, or one on which it did not come back within a minute. Exit status 1 says there is either.
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fuzz.targets import MODULES, target

HERE: Final = Path(__file__).resolve().parent
HANGS_S: Final = 60
MEMORY_MB: Final = 6_000
MAX_INPUT_BYTES: Final = 20_000
MAX_RESTARTS: Final = 50
_TELL_EVERY_S: Final = 15.0
_COVERED: Final = re.compile(r"cov: (\d+) ft: (\d+) corp: (\d+)/")
_PACKAGES: Final = ("chauffeur", "atheris", "pydantic-monty")


def main() -> int:
    """Fuzz as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--target", required=True, choices=[*MODULES, "all"])
    parser.add_argument("--executions", type=int, default=10_000, help="of each target")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path.home() / ".cache" / "chauffeur-fuzz")
    parser.add_argument("--replay", type=Path, help="an input, or a finding as it was written")
    given = parser.parse_args()
    if given.replay is not None:
        return _replay(given.target, given.replay)
    if _version("atheris") == "none":
        print("atheris is not installed: pip install atheris", file=sys.stderr)
        return 2
    names = list(MODULES) if given.target == "all" else [given.target]
    results = [_fuzz(name, given.out / name, given.executions, given.seed) for name in names]
    return 1 if any(result["findings"] or result["crashes"] for result in results) else 0


def _replay(name: str, path: Path) -> int:
    data = path.read_bytes()
    if path.suffix == ".json":
        data = base64.b64decode(json.loads(data)["input"])
    print(target(name).examine(data))
    return 0


def _fuzz(name: str, folder: Path, executions: int, seed: int) -> dict[str, Any]:
    fuzzed = target(name)
    for inside in ("corpus", "seeds", "crashes"):
        (folder / inside).mkdir(parents=True, exist_ok=True)
    shutil.rmtree(folder / "findings", ignore_errors=True)
    for number, data in enumerate(fuzzed.seeds()):
        (folder / "seeds" / f"{number:04d}").write_bytes(data)
    before = {path.name for path in (folder / "crashes").iterdir()}
    done, outcomes, restarts = 0, dict[str, int](), 0
    covered = (0, 0)
    begun = time.monotonic()
    while done < executions and restarts <= MAX_RESTARTS:
        state = _one_process(name, fuzzed.reads, folder, executions - done, seed + 1000 * restarts, done)
        done += state["executions"]
        for outcome, count in state["outcomes"].items():
            outcomes[outcome] = outcomes.get(outcome, 0) + count
        covered = max(covered, state["covered"])
        restarts += 1
    seconds = time.monotonic() - begun
    earlier = _earlier(folder)
    findings = [json.loads(path.read_text("utf-8")) for path in sorted((folder / "findings").glob("*.json"))]
    crashes = sorted({path.name for path in (folder / "crashes").iterdir()} - before)
    result = {
        "target": name,
        "invariant": fuzzed.invariant,
        "seed": seed,
        "executions": done,
        "seconds": round(seconds, 1),
        "executions_with_earlier_runs": done + earlier["executions_with_earlier_runs"],
        "seconds_with_earlier_runs": round(seconds + earlier["seconds_with_earlier_runs"], 1),
        "findings": findings,
        "crashes": crashes,
        "outcomes": dict(sorted(outcomes.items(), key=lambda item: -item[1])),
        "coverage": {
            "edges": covered[0],
            "features": covered[1],
            "corpus": sum(1 for _ in (folder / "corpus").iterdir()),
        },
        "versions": {"python": platform.python_version(), **{one: _version(one) for one in _PACKAGES}},
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
    }
    (folder / "result.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    print(
        f"{name}: {done} executions in {seconds:.0f} s, {len(findings)} findings, {len(crashes)} crashes, "
        f"{covered[0]} edges; {folder / 'result.json'}"
    )
    for finding in findings:
        print(f"  {finding['error']}: {finding['says'][:120]} ({finding['times']} times, {finding['where'][-1]})")
    return result


def _one_process(
    name: str, reads: tuple[str, ...], folder: Path, executions: int, seed: int, done: int
) -> dict[str, Any]:
    """Let one process fuzz until it is done or dead, and tell of its progress."""
    (folder / "state.json").unlink(missing_ok=True)
    log = folder / "log.txt"
    options = [
        f"-runs={executions}", f"-seed={seed}", f"-timeout={HANGS_S}", f"-rss_limit_mb={MEMORY_MB}",
        f"-report_slow_units={HANGS_S}", f"-max_len={MAX_INPUT_BYTES}", "-len_control=0",
        f"-artifact_prefix={folder / 'crashes'}/",
        "-mutate_depth=1",  # a change of the target's own is a large one; several at once would leave no program
    ]  # fmt: skip
    folders = [str(folder / "corpus"), str(folder / "seeds")]
    command = [sys.executable, str(HERE / "child.py"), name, str(folder), str(executions), json.dumps(reads)]
    with log.open("wb") as file:
        # Hashes of texts must not differ from run to run: the same seed is to do the same.
        environment = {**os.environ, "PYTHONHASHSEED": "0"}
        process = subprocess.Popen([*command, *options, *folders], stdout=file, stderr=file, env=environment)
        try:
            told = time.monotonic()
            while process.poll() is None:
                time.sleep(0.2)
                if time.monotonic() - told > _TELL_EVERY_S:
                    told = time.monotonic()
                    state = _state(folder)
                    edges = _covered(log)[0]
                    print(
                        f"  {name}: {done + state['executions']} executions, {len(state['findings'])} findings, "
                        f"{edges} edges"
                    )
        except KeyboardInterrupt:
            process.terminate()
            process.wait()
            raise
    return {**_state(folder), "covered": _covered(log)}


def _state(folder: Path) -> dict[str, Any]:
    try:
        return json.loads((folder / "state.json").read_text("utf-8"))
    except FileNotFoundError:
        return {"executions": 0, "outcomes": {}, "findings": []}


def _earlier(folder: Path) -> dict[str, Any]:
    """The result of the runs before with this corpus."""
    try:
        return json.loads((folder / "result.json").read_text("utf-8"))
    except FileNotFoundError:
        return {"executions_with_earlier_runs": 0, "seconds_with_earlier_runs": 0.0}


def _covered(log: Path) -> tuple[int, int]:
    """(edges, features) of the last line in which libFuzzer tells them."""
    with log.open("rb") as file:
        file.seek(max(0, log.stat().st_size - 20_000))
        found = _COVERED.findall(file.read().decode("utf-8", "replace"))
    return (int(found[-1][0]), int(found[-1][1])) if found else (0, 0)


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


if __name__ == "__main__":
    sys.exit(main())
