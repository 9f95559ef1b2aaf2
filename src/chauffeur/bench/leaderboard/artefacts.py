"""Artefacts of a finished run beside its rows: the official results file, and a map of each route."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any, Final

from chauffeur.bench.leaderboard.benchmark import LeaderboardBenchmark, RouteItem
from chauffeur.bench.leaderboard.criteria import Infraction, InfractionKind
from chauffeur.bench.leaderboard.results import infractions_of, write_official
from chauffeur.bench.leaderboard.track import RouteTrack
from chauffeur.bench.leaderboard.ways import plan_official
from chauffeur.concept import ChauffeurError
from chauffeur.geometry import RoadGraph
from chauffeur.hmi.road import draw_road, track_box
from chauffeur.hmi.stills import LOOKS, DrawnShape, road_shapes, style_of_looks, svg_of
from chauffeur.hmi.view import as_picture
from chauffeur.worlds.town.library import load

WIDE_PX: Final = 900
_MARGIN_M: Final = 30.0
_HEAD_PX: Final = 54
_LINE_PX: Final = 18
_LABELS: Final[dict[InfractionKind, tuple[str, str]]] = {
    "collisions_pedestrian": ("person hit", "#b00020"),
    "collisions_vehicle": ("vehicle hit", "#e4572e"),
    "collisions_layout": ("thing hit", "#8d5524"),
    "red_light": ("red light run", "#d4007a"),
    "stop_infraction": ("stop sign run", "#7b2cbf"),
    "outside_route_lanes": ("outside the lanes", "#6c757d"),
    "route_dev": ("left the route", "#003049"),
    "route_timeout": ("out of time", "#003049"),
    "vehicle_blocked": ("blocked", "#003049"),
}


def route_map(
    road: RoadGraph,
    track: RouteTrack,
    path: Sequence[tuple[float, float]],
    infractions: Sequence[Infraction],
    title: str,
    note: str,
) -> str:
    """The map.

    Args:
        road: Of the town; its driving lanes round the route are drawn.
        track: The way.
        path: Places the ego was at.
        infractions: What was broken; numbered in the order of time.
        title, note: Two lines above it; the note names the engine.
    """
    way = tuple((one.x_m, -one.y_m) for one in track.poses)
    driven = tuple((x, -y) for x, y in path)
    box = track_box((*way, *driven)).grown(_MARGIN_M)
    wide, high = box.x1 - box.x0, box.y1 - box.y0
    tall = high * WIDE_PX / wide
    placed = [one for one in infractions if one.kind != "outside_route_lanes"]
    legend = [f"{i}  {_LABELS[one.kind][0]}, {one.time_s:.0f} s" for i, one in enumerate(placed, 1)]
    legend += [f"{100.0 * one.share:.1f} % outside the lanes" for one in infractions if one not in placed]
    dot = wide / 100.0
    shapes = [
        *road_shapes(draw_road(as_picture(road, ())[0], (), box)),
        DrawnShape("line", "", way, max(2.4, 0.5 * dot), paint="#7fa6d6"),
        *([DrawnShape("line", "trail", driven, max(0.4, 0.2 * dot))] if len(driven) > 1 else []),
    ]
    for name, place in (("start", way[0]), ("goal", way[-1])):
        shapes.append(DrawnShape("dot", "place", (place,), 0.6 * dot))
        shapes.append(DrawnShape("text", "place", ((place[0] + dot, place[1] - dot),), 1.6 * dot, name, start=True))
    for i, one in enumerate(placed, 1):
        shapes.append(DrawnShape("dot", "", ((one.x_m, -one.y_m),), dot, paint=_LABELS[one.kind][1]))
        shapes.append(DrawnShape("text", "plate", ((one.x_m, -one.y_m),), 1.3 * dot, str(i)))
    bottom = _HEAD_PX + tall + _LINE_PX * (len(legend) + 2)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDE_PX}" height="{bottom:.0f}" '
        f'viewBox="0 0 {WIDE_PX} {bottom:.0f}" font-family="sans-serif" font-size="13">{style_of_looks()}',
        f'<rect width="{WIDE_PX}" height="{bottom:.0f}" fill="#ffffff"/>',
        f'<text x="10" y="22" font-size="17" font-weight="bold">{escape(title)}</text>',
        f'<text x="10" y="42" fill="#555">{escape(note)}</text>',
        f'<svg y="{_HEAD_PX}" width="{WIDE_PX}" height="{tall:.1f}" '
        f'viewBox="{box.x0:.1f} {box.y0:.1f} {wide:.1f} {high:.1f}" overflow="hidden">',
        f'<rect x="{box.x0:.1f}" y="{box.y0:.1f}" width="100%" height="100%" fill="{LOOKS["ground"]}"/>',
        svg_of(shapes),
        "</svg>",
    ]
    for i, text in enumerate(legend or ["No rule was broken."]):
        y = _HEAD_PX + tall + _LINE_PX * (i + 1.2)
        parts.append(f'<text x="10" y="{y:.0f}">{escape(text)}</text>')
    parts.append("</svg>\n")
    return "\n".join(parts)


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
