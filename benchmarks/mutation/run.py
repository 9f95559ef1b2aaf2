"""Mutation testing of the checks before a drive: small changes are made to them, and some test must notice each.

    python benchmarks/mutation/run.py [--modules envelope,gate] [--out DIR]

Needs mutmut 3 (`pip install mutmut`). It works on a copy in the folder of `--out` and never touches this repository;
a second run goes on where the first ended, and tries again what has changed and what no test had noticed. Each module
is tried against the few test files that are about it. `RESULT.json` there has the figures, `survivors.txt` every mutant
that no test noticed, as a difference; SURVIVORS.md beside this file says of those that stay why they do not matter.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

ROOT: Final = Path(__file__).resolve().parents[2]

KILLED, SURVIVED, UNTESTED, TIMED_OUT, SUSPICIOUS = "killed", "survived", "untested", "timed out", "suspicious"
_BY_EXIT_CODE: Final = {1: KILLED, 3: KILLED, 0: SURVIVED, 5: UNTESTED, 33: UNTESTED, 36: TIMED_OUT, 24: TIMED_OUT}
"""mutmut's own table; -24 and 152 are a CPU limit that was reached."""
_LEFT: Final = (SURVIVED, UNTESTED, SUSPICIOUS)


@dataclass(frozen=True, slots=True)
class Module:
    """A module, and the tests that are about it."""

    path: str
    tests: tuple[str, ...]


def _tested(path: str, *tests: str) -> Module:
    return Module(path, tuple(f"tests/{test}.py" for test in tests))


_AUDIT: Final = tuple(f"safety/test_audit{part}" for part in ("_verdicts", "_texts", "_ends", ""))
_AUDIT_FILE: Final = ("safety/test_audit_storage", "safety/test_audit_writer")
_FAITHFULNESS: Final = ("safety/test_explanations", "bench/test_faithfulness")
_SHIELD: Final = tuple(f"safety/test_shield{part}" for part in ("_rules", "_crossing", ""))
_GATE: Final = ("programs/test_gate_edges", "programs/test_syntax_checks")
MODULES: Final = {
    "envelope": _tested("safety/envelope.py", "safety/test_parameters_check"),
    "format": _tested("safety/format.py", "safety/test_checks"),
    "reach": _tested("safety/reach.py", "safety/test_reach"),
    "checks": _tested("safety/checks.py", "safety/test_checks"),
    "screening": _tested("safety/screening.py", "safety/test_screening"),
    "concealment": _tested("safety/concealment.py", "safety/test_screening"),
    "constant_calls": _tested("safety/constant_calls.py", "safety/test_constant_calls", "safety/test_parameters_check"),
    "trajectories": _tested("safety/trajectories.py", "safety/test_gains_and_trajectories"),
    "bounds": _tested("safety/bounds.py", "safety/test_bounds"),
    "blame": _tested("safety/blame.py", "safety/test_blame"),
    "gaps": _tested("safety/shield/gaps.py", "safety/test_shield_gaps"),
    "frame": _tested("safety/shield/frame.py", "safety/test_shield_frame"),
    "sweep": _tested("safety/shield/sweep.py", "safety/test_shield_frame"),
    "shield": _tested("safety/shield/shield.py", *_SHIELD),
    "crossing": _tested("safety/shield/crossing.py", "safety/test_shield_traffic_arrays", *_SHIELD),
    "traffic_arrays": _tested("safety/shield/traffic_arrays.py", "safety/test_shield_traffic_arrays"),
    "gate": _tested("programs/gate.py", *_GATE),
    "syntax_checks": _tested("programs/syntax_checks.py", *_GATE),
    **{
        f"audit.{part}": _tested(f"safety/audit/{part}.py", *(_AUDIT_FILE if part in ("storage", "writer") else _AUDIT))
        for part in ("keys", "heads", "reader", "storage", "redaction", "texts", "entries", "verification", "writer")
    },
    **{
        f"faithfulness.{part}": _tested(f"safety/faithfulness/{part}.py", *_FAITHFULNESS)
        for part in ("report", "check", "claims", "comparison", "driven", "facts", "judge", "numbers", "relations")
    },
}
_SLOW: Final = (
    "tests/safety/test_explanations.py::test_plans_of_our_own_are_not_called_unfaithful",
    "tests/programs/test_syntax_checks.py::test_what_the_compiler_takes_runs",
    "tests/programs/test_syntax_checks.py::test_formats_that_can_be_are_not_refused",
    "tests/programs/test_syntax_checks.py::test_benign_programs_have_nothing_misplaced",
    "tests/safety/test_audit.py::test_any_body_is_written_and_read",
    "tests/safety/test_audit.py::test_any_byte_put_anywhere_is_found",
    "tests/safety/test_audit.py::test_changes_of_single_bytes_all_over_are_found",
    "tests/safety/test_audit.py::test_exchanged_records_are_found",
    "tests/safety/test_audit.py::test_foreign_lines_are_found",
    "tests/safety/test_audit.py::test_inserted_records_are_found",
    "tests/safety/test_audit.py::test_records_taken_out_of_the_middle_are_found",
    "tests/safety/test_audit.py::test_what_is_no_record_is_refused_in_one_way",
    "tests/safety/test_audit_writer.py::test_a_disk_that_was_full_for_a_while_leaves_a_gap_that_is_told",
    "tests/safety/test_audit_writer.py::test_a_disk_that_hangs_keeps_nobody_waiting",
    "tests/safety/test_audit_writer.py::test_a_full_device_does_not_raise_into_the_drive",
    "tests/safety/test_audit_writer.py::test_a_torn_end_is_not_tampering_and_the_chain_goes_on",
    "tests/safety/test_audit_writer.py::test_many_threads_share_one_chain",
    "tests/safety/test_audit_writer.py::test_nothing_acknowledged_is_lost_by_kill_9",
    "tests/safety/test_reach.py::test_no_program_of_the_meaning_planner_is_refused_that_passed_before",
    "tests/safety/test_screening.py::test_the_time_is_not_the_senders_to_choose",
    "tests/safety/test_shield.py::test_a_hostile_policy_hurts_nobody_under_the_shield",
    "tests/safety/test_shield.py::test_who_cuts_in_is_to_blame_not_who_was_cut_off",
    "tests/safety/test_shield.py::test_running_into_somebody_is_the_egos_own_blame",
    "tests/safety/test_shield.py::test_who_never_yields_is_made_to_and_gets_across",
    "tests/safety/test_shield_crossing.py::test_what_once_ended_badly_does_not",
)


_FORGETFUL: Final = """
import gc
from functools import _lru_cache_wrapper

_kept = []


def pytest_collection_finish(session):
    _kept[:] = [one for one in gc.get_objects() if isinstance(one, _lru_cache_wrapper)
                and str(one.__module__).startswith(("chauffeur.programs", "chauffeur.safety"))]


def pytest_runtest_setup(item):
    for one in _kept:
        one.cache_clear()
"""
"""A plugin for pytest: verdicts remembered from before a mutation must not stand for those after it."""


def main() -> int:
    """Try the mutants of the modules named."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--modules", default=",".join(MODULES), help=f"of {', '.join(MODULES)}")
    parser.add_argument("--out", type=Path, default=Path.home() / ".cache" / "chauffeur-mutation")
    given = parser.parse_args()
    names = given.modules.split(",")
    if unknown := set(names) - MODULES.keys():
        parser.error(f"no such module: {', '.join(sorted(unknown))}")
    try:
        version("mutmut")
    except PackageNotFoundError:
        print("mutmut is not installed: pip install mutmut", file=sys.stderr)
        return 2
    results = [_tried(name, MODULES[name], given.out / name) for name in names]
    for result in results:
        (given.out / result["module"] / "RESULT.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    print(
        f"\n{'module':<12}{'mutants':>8}{'killed':>8}{'survived':>10}{'untested':>10}{'timed out':>10}{'killed, %':>11}"
    )
    for result in results:
        count = result["mutants"]
        caught = result[KILLED] + result[TIMED_OUT]
        share = 100.0 * caught / count if count else 0.0
        print(
            f"{result['module']:<12}{count:>8}{result[KILLED]:>8}{result[SURVIVED]:>10}{result[UNTESTED]:>10}"
            f"{result[TIMED_OUT]:>10}{share:>11.1f}"
        )
    return 0


def _tried(name: str, module: Module, folder: Path) -> dict[str, Any]:
    _laid_out(module, folder)
    meta = folder / "mutants" / "src" / "chauffeur" / f"{module.path}.meta"
    _forget_what_was_left(meta)
    begun = time.monotonic()
    environment = {**os.environ, "PYTHONPATH": ""}
    with (folder / "log.txt").open("wb") as log:
        subprocess.run(
            [sys.executable, "-m", "mutmut", "run", "--max-children", "1"],
            cwd=folder, stdout=log, stderr=log, env=environment, check=False,
        )  # fmt: skip
    verdicts = _verdicts(meta)
    if not verdicts:
        print(f"{name}: nothing was tried, because its tests fail unchanged; {folder / 'log.txt'}", file=sys.stderr)
    counts = Counter(verdicts.values())
    left = sorted(key for key, verdict in verdicts.items() if verdict in _LEFT)
    (folder / "survivors.txt").write_text(_shown(left, folder), encoding="utf-8")
    print(
        f"{name}: {len(verdicts)} mutants in {time.monotonic() - begun:.0f} s, {len(left)} left; {folder / 'log.txt'}"
    )
    return {
        "module": name,
        "path": module.path,
        "tests": module.tests,
        "mutants": len(verdicts),
        **{verdict: counts[verdict] for verdict in (KILLED, SURVIVED, UNTESTED, TIMED_OUT, SUSPICIOUS)},
        "left": left,
        "versions": {
            "python": platform.python_version(),
            "mutmut": version("mutmut"),
            "chauffeur": version("chauffeur"),
        },
    }


def _laid_out(module: Module, folder: Path) -> None:
    """A copy of the sources and tests, with mutmut's settings."""
    folder.mkdir(parents=True, exist_ok=True)
    for part in ("src", "tests", "docs", "data"):
        _mirrored(ROOT / part, folder / part)
    present = [test for test in module.tests if (ROOT / test).is_file()]
    deselected = [f"--deselect={test}" for test in _SLOW if test.partition("::")[0] in present]
    (folder / "forgetful.py").write_text(_FORGETFUL, encoding="utf-8")
    arguments = ["-p", "forgetful", "-p", "no:xdist", "-p", "no:cacheprovider", "-p", "no:randomly", *deselected]
    lines = [
        "[mutmut]",
        "source_paths=src",
        f"only_mutate=src/chauffeur/{module.path}",
        "use_git_change_detection=False",
        "also_copy=\n    forgetful.py\n    docs\n    data",
        "mutate_only_covered_lines=False",
        "timeout_constant=15.0",  # a busy machine is no infinite loop
        "pytest_add_cli_args=" + "".join(f"\n    {one}" for one in arguments),
        "pytest_add_cli_args_test_selection=" + "".join(f"\n    {one}" for one in present),
    ]
    (folder / "setup.cfg").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _mirrored(source: Path, copy: Path) -> None:
    """Copy what has changed, remove what is gone; what has not changed keeps its time, by which mutmut goes."""
    there = {
        path.relative_to(source) for path in source.rglob("*") if path.is_file() and "__pycache__" not in path.parts
    }
    for path in copy.rglob("*"):
        if path.is_file() and path.relative_to(copy) not in there:
            path.unlink()
    for relative in there:
        one, other = source / relative, copy / relative
        if not other.is_file() or other.stat().st_mtime != one.stat().st_mtime:
            other.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(one, other)


def _forget_what_was_left(meta: Path) -> None:
    """Mutants that no test noticed are tried again: there may be new tests."""
    if not meta.is_file():
        return
    kept: dict[str, Any] = json.loads(meta.read_text("utf-8"))
    codes: dict[str, int | None] = kept["exit_code_by_key"]
    for key, verdict in _verdicts(meta).items():
        if verdict in _LEFT:
            codes[key] = None
    meta.write_text(json.dumps(kept), encoding="utf-8")


def _verdicts(meta: Path) -> dict[str, str]:
    codes: dict[str, int | None] = json.loads(meta.read_text("utf-8"))["exit_code_by_key"]
    return {
        key: TIMED_OUT if code is not None and (code < 0 or code == 152) else _BY_EXIT_CODE.get(code or 0, SUSPICIOUS)
        for key, code in codes.items()
        if code is not None
    }


_SHOW: Final = """
import sys
from mutmut.mutation.diff_apply import get_diff_for_mutant
for key in sys.stdin.read().split():
    print(f"# {key}")
    print(get_diff_for_mutant(key))
"""


def _shown(keys: list[str], folder: Path) -> str:
    """Mutants as differences."""
    done = subprocess.run(
        [sys.executable, "-c", _SHOW], input="\n".join(keys), cwd=folder, capture_output=True, text=True, check=False
    )
    return done.stdout or done.stderr


if __name__ == "__main__":
    sys.exit(main())
