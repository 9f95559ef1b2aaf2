"""What a recall costs where a person has driven a lot, what a write costs with its sync, and what erasing leaves.

The interactions are generated: wishes put together from phrases, with numbers, weather and feedback. Run:
python benchmarks/memory_recall.py --trips 10000 --trips 100000
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from chauffeur.concept import (
    Causes,
    Context,
    Feedback,
    History,
    Instruction,
    Parameters,
    PersonId,
    Plan,
    Situation,
    Thoughts,
    Trip,
)
from chauffeur.memory import VaultMemory, interpret_feedback
from chauffeur.memory.privacy import Privacy
from chauffeur.memory.profile import Change, Index, Profile

GOALS_MS = {10_000: 1.0, 100_000: 10.0}
"""p50 of a recall, by how much is remembered."""

PERSON = PersonId("Generated")
BEGIN = datetime(2026, 1, 1, tzinfo=UTC)
_OPENINGS = ("", "please ", "could you ", "I would like you to ", "now ", "if you can, ", "hey, ")
_WISHES = (
    "drive faster", "drive slower", "slow down a bit", "hurry up", "keep more distance", "get closer to the car ahead",
    "change to the left lane", "change to the right lane", "overtake the truck", "do not overtake", "turn left",
    "take it easy", "drive at {n} km/h", "keep a distance of {n} meters", "go {n} km/h faster", "play some music",
)  # fmt: skip
_ENDINGS = (
    "",
    " on this road",
    ", I am late",
    ", the kids are asleep",
    " until the next exit",
    ", my back hurts",
    " now",
)
_REMARKS = ("a bit too fast", "too slow", "way too close", "too far from the car ahead", "perfect", "too jerky")
_SCENES = ("Weather: light rain, 12 °C.", "Weather: clear sky, 20 °C.", "Weather: not known (offline).")
_WORLDS = ("highway", "intersection", "parking")
SECRET = b"xylophonequartz"
"""In every wish; no byte on the disk may spell it."""


def _wish(rng: np.random.Generator) -> str:
    def one(of: tuple[str, ...]) -> str:
        return of[int(rng.integers(len(of)))]

    return f"{one(_OPENINGS)}{one(_WISHES).format(n=int(rng.integers(5, 140)))}{one(_ENDINGS)}"


def _trips(count: int) -> Iterator[tuple[Trip, Feedback | None]]:
    rng = np.random.default_rng(1)
    for number in range(count):
        scene = (("weather", _SCENES[int(rng.integers(3))]),)
        world = _WORLDS[int(rng.integers(3))]
        situation = Situation(world, 30.0, 31.3, 3, 1, False, None, None, scene=scene)
        context = Context(f"I am driving at 30.0 m/s on a {world}. {scene[0][1]}", situation)
        plan = Plan(Thoughts("You want a change; I make it within the limit."), Parameters(25.0, 12.0, 2.0), intent="x")
        wish = Instruction(f"{_wish(rng)} {SECRET.decode()}", PERSON)
        feedback = interpret_feedback(_REMARKS[int(rng.integers(len(_REMARKS)))]) if rng.random() < 0.3 else None
        yield (
            Trip(f"t{number}", wish, context, History(), plan, (), "success", Causes(), (), 12.0, "s", 1),
            feedback,
        )


def _times_ms(work: Callable[[int], object], count: int) -> dict[str, float]:
    """Wall and processor time; on a busy machine the second tells more."""
    taken: list[float] = []
    computed: list[float] = []
    for number in range(count):
        before, cpu_before = time.perf_counter(), time.process_time()
        work(number)
        taken.append((time.perf_counter() - before) * 1e3)
        computed.append((time.process_time() - cpu_before) * 1e3)
    taken.sort()
    return {
        "p50_ms": statistics.median(taken),
        "p95_ms": taken[int(0.95 * len(taken))],
        "least_ms": taken[0],
        "cpu_p50_ms": statistics.median(computed),
    }


@contextmanager
def _within_one_transaction(_: Profile) -> Iterator[list[Change]]:
    yield []


def _fill(vault: VaultMemory, count: int, minutes: list[int]) -> None:
    """Write the trips by way of the profile itself, all in one transaction: only what is read later is measured."""
    trips = _trips(count)
    first, feedback = next(trips)
    vault.remember(first, feedback)
    (path,) = vault._profiles.glob("*.db")
    key = vault._ring.find(path.stem)
    assert key is not None
    profile = Profile(path, key, Index())
    profile._connection.execute("BEGIN IMMEDIATE")
    with patch.object(Profile, "_writing", _within_one_transaction):
        for number, (trip, said) in enumerate(trips, start=1):
            when = (BEGIN + timedelta(minutes=number)).isoformat(timespec="milliseconds")
            profile.add(trip, said, when, "")
    profile._connection.execute("UPDATE about SET value = ? WHERE name = 'writes'", (count,))
    profile._connection.execute("COMMIT")
    profile.close()
    minutes[0] = count


def _spelled(folder: Path, word: bytes) -> list[str]:
    forms = [word, word.decode().encode("utf-16-le"), word.decode().encode("utf-16-be"), word.upper()]
    return [p.name for p in folder.rglob("*") if p.is_file() and any(form in p.read_bytes() for form in forms)]


def _measured(count: int, recalls: int, writes: int) -> dict[str, Any]:
    with tempfile.TemporaryDirectory(prefix="memory_recall_") as folder:
        home, minutes = Path(folder), [0]
        privacy = Privacy(None)

        def clock() -> datetime:
            minutes[0] += 1
            return BEGIN + timedelta(minutes=minutes[0])

        vault = VaultMemory(home, privacy=privacy, clock=clock)
        before = time.perf_counter()
        _fill(vault, count, minutes)
        filled_s = time.perf_counter() - before
        vault.close()
        vault = VaultMemory(home, privacy=privacy, clock=clock)
        rng = np.random.default_rng(2)
        wishes = [Instruction(_wish(rng), PERSON) for _ in range(recalls)]
        place = Situation("highway", 30.0, 31.3, 3, 1, False, None, None, scene=(("weather", _SCENES[0]),))
        context = Context("I am driving at 30.0 m/s.", place)
        before = time.perf_counter()
        vault.recall(PERSON, wishes[0], context, 3)
        first_ms = (time.perf_counter() - before) * 1e3
        time.sleep(0.2)
        vault.recall(PERSON, wishes[0], context, 3)
        found: list[int] = []
        recall = _times_ms(lambda n: found.append(len(vault.recall(PERSON, wishes[n], context, 3).items)), recalls)
        more = list(_trips(writes))
        write = _times_ms(lambda n: vault.remember(replace(more[n][0], id=f"more{n}"), more[n][1]), writes)
        after_write = _times_ms(
            lambda n: (vault.remember(*more[n]), vault.recall(PERSON, wishes[n], context, 3)), min(writes, recalls)
        )
        megabytes = sum(path.stat().st_size for path in home.rglob("*") if path.is_file()) / 1e6
        (columns,) = [one.index.columns for one in vault._opened.values()]
        spelled = _spelled(home, SECRET)
        arrays = [columns._marks._vectors, columns._marks._amounts.values, columns._kinds.values]
        arrays += [columns.rows, columns.whens, columns.circumstances]
        distinct = len(columns._marks) - 1
        erased = vault.erase(PERSON)
        return {
            "trips": count,
            "recall": recall,
            "items_found_mean": statistics.mean(found),
            "first_recall_of_a_process_ms": first_ms,
            "remember_with_sync": write,
            "remember_and_recall": after_write,
            "filled_s": filled_s,
            "file_mb": megabytes,
            "distinct_wishes": distinct,
            "columns_mb": sum(array.nbytes for array in arrays) / 1e6,
            "files_that_spell_a_wish": spelled,
            "erased": erased,
            "files_left_after_erase": sorted(p.name for p in home.rglob("*") if p.is_file()),
            "numbers_left_in_memory_after_erase": int(sum(np.count_nonzero(array) for array in arrays)),
            "goal_met": recall["p50_ms"] <= GOALS_MS.get(count, float("inf")),
        }


def main() -> None:
    """Measure, print a table, then the same as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trips", type=int, action="append")
    parser.add_argument("--recalls", type=int, default=300)
    parser.add_argument("--writes", type=int, default=50)
    asked = parser.parse_args()
    rows = [_measured(count, asked.recalls, asked.writes) for count in asked.trips or [1_000, 10_000]]
    wide = (("trips", 8), ("recall p50 ms", 15), ("p95", 8), ("least", 8), ("cpu p50", 9), ("first ms", 10))
    wide += (("write p50 ms", 14), ("p95", 8), ("file MB", 9))
    print("".join(f"{name:>{width}}" for name, width in wide))
    for row in rows:
        recall, write = row["recall"], row["remember_with_sync"]
        print(
            f"{row['trips']:8}{recall['p50_ms']:15.3f}{recall['p95_ms']:8.3f}{recall['least_ms']:8.3f}"
            f"{recall['cpu_p50_ms']:9.3f}{row['first_recall_of_a_process_ms']:10.0f}"
            f"{write['p50_ms']:14.2f}{write['p95_ms']:8.2f}{row['file_mb']:9.1f}"
        )
        met = "met" if row["goal_met"] else "missed"
        left, numbers = row["files_left_after_erase"], row["numbers_left_in_memory_after_erase"]
        print(f"{'':8}{row['distinct_wishes']} of the wishes differ from each other;")
        print(f"{'':8}goal {met}; a wish is spelled in {row['files_that_spell_a_wish'] or 'no file'};")
        print(f"{'':8}after erase: files {', '.join(left)}; {numbers} numbers in memory")
    machine = {"cores": os.cpu_count(), "load": os.getloadavg(), "python": platform.python_version()}
    print(json.dumps({"machine": machine, "rows": rows}))


if __name__ == "__main__":
    main()
