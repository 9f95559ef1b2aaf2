"""Real runs and a trip to look at: a recorded planner and a baseline on the same drives, explanations, a drive."""

from __future__ import annotations

from pathlib import Path

from sample_trips import highway_trip

from chauffeur.bench.faithfulness.benchmark import FaithfulnessBenchmark
from chauffeur.bench.kernel.run import BenchRun, Effort
from chauffeur.bench.viewer.content import Content
from chauffeur.bench.viewer.shelf import Shelf
from chauffeur.driving.recording import write_trip
from small_run import SEEDS, Inline, finish, make_data, make_run, quiet, recorded


def make_folders(root: Path) -> Path:
    """Make `runs/recorded`, `runs/mobil`, `runs/faithfulness` and `trips/overtake` in a folder."""
    dataset = make_data(root / "data", SEEDS[:2])
    finish(make_run(root / "runs" / "recorded", dataset, recorded(root / "answers.jsonl")))
    finish(make_run(root / "runs" / "mobil", dataset, "mobil"))
    BenchRun(root / "runs" / "faithfulness", FaithfulnessBenchmark(1)).run(quiet, Effort(workers=1, engine=Inline))
    trip = highway_trip(seconds=4.0)
    write_trip(root / "trips" / "overtake" / "trip.mcap", trip.trip, trip.frames, trip.scenario, final=trip.final)
    return root


def content_of(*folders: Path) -> Content:
    """What there is to look at in folders."""
    return Content(Shelf([folder.resolve() for folder in folders]))


def ids_of(content: Content) -> dict[str, str]:
    """Ids of runs and trips by the last folder of where they lie."""
    index = content.index()
    runs = {line["where"].rsplit("/", 1)[-1]: line["id"] for line in index["runs"]}
    return runs | {line["where"].split("/")[-2]: line["id"] for line in index["trips"]}
