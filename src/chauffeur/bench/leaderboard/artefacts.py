"""What a finished run leaves beside its rows: the official results file, and a map of each route."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from chauffeur.bench.leaderboard.benchmark import LeaderboardBenchmark, RouteItem
from chauffeur.bench.leaderboard.results import infractions_of, write_official
from chauffeur.bench.leaderboard.route_map import route_map
from chauffeur.bench.leaderboard.ways import plan_official
from chauffeur.concept import ChauffeurError

OFFICIAL: Final = "official-results.json"


def write_artefacts(
    folder: Path, benchmark: LeaderboardBenchmark, rows: Sequence[Mapping[str, Any]], results: Mapping[str, Any]
) -> tuple[Path, ...]:
    """Write them; returns their paths.

    Args:
        folder: Of the run.
        benchmark: Whose rows they are.
        rows: All rows.
        results: What was stored of each drive, by item.
    """
    broken = {str(row["item"]): infractions_of(results[row["item"]]["infractions"]) for row in rows}
    official = folder / OFFICIAL
    write_official(official, rows, broken)
    written = [official]
    items: dict[str, RouteItem] = {one.id: one for one in benchmark.items()}
    maps = folder / "maps"
    for row in rows:
        name = str(row["item"])
        route = benchmark.route_of(items[name])
        try:
            from chauffeur.worlds.town.library import load

            town = load(route.town)
            track = plan_official(town, route).track
        except (ChauffeurError, IndexError):
            continue  # a route that could not be driven has no map
        maps.mkdir(exist_ok=True)
        title = f"Route {row['route']}, {row['town']}, seed {row['seed']}, {row['driver']}: {row['status']}"
        note = (
            f"RC {row['rc']:.1f}  IP {row['ip']:.3f}  DS {row['ds']:.1f}  ·  engine {row['engine']} (simulated)  ·  "
            f"scenarios {row['scenarios']}, {row['triggered']} of {row['placed']} set off"
        )
        path = maps / f"{name}.svg"
        path.write_text(route_map(town.road, track, results[name]["path"], broken[name], title, note))
        written.append(path)
    return tuple(written)
