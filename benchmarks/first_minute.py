"""What a newcomer waits for: a fresh clone, its installation, the first and the next drive, and what is then on disk.

    python benchmarks/first_minute.py [--python python3.12]

Clones this checkout into a temporary folder, with caches of its own, and prints the rows of "First minute" in RESULTS.
Wall-clock times say little on a busy machine: the load and the processor time stand beside them.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def timed(command: list[str], folder: Path, env: dict[str, str]) -> tuple[float, float]:
    """Wall-clock and processor time of a command, s."""
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, cwd=folder, env=env, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.perf_counter() - begun, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def megabytes(folder: Path) -> float:
    """What a folder takes on the disk, MiB."""
    return sum(path.lstat().st_blocks * 512 for path in folder.rglob("*")) / 2**20


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--python", default="python3.11", help="Interpreter to install for.")
    python = parser.parse_args().python
    with tempfile.TemporaryDirectory(prefix="chauffeur-first-") as name:
        clone, home = Path(name) / "chauffeur", Path(name) / "home"
        home.mkdir()
        env = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
        env |= {"HOME": str(home), "XDG_CACHE_HOME": str(home / "cache")}
        subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
        make = ["make", f"PYTHON={python}"]
        rows = [
            ("installing", timed([*make, ".venv/.core"], clone, env)),
            ("the first drive", timed([*make, "drive"], clone, env)),
            ("the next drive", timed([*make, "drive"], clone, env)),
        ]
        command = [str(clone / ".venv" / "bin" / "chauffeur"), "--help"]
        helps = [timed(command, clone, env) for _ in range(7)]
        rows.append(
            ("`chauffeur --help`", (statistics.median(w for w, _ in helps), statistics.median(c for _, c in helps)))
        )
        for what, (wall_s, cpu_s) in rows:
            print(f"| {what} | {wall_s:.2f} s ({cpu_s:.2f} s of processor time) |")
        print(f"| `.venv` | {megabytes(clone / '.venv'):.0f} MB |")
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    main()
