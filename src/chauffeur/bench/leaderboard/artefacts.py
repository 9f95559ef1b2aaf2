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
    xs = [one.x_m for one in track.poses] + [x for x, _ in path]
    ys = [one.y_m for one in track.poses] + [y for _, y in path]
    left, right = min(xs) - _MARGIN_M, max(xs) + _MARGIN_M
    low, high = min(ys) - _MARGIN_M, max(ys) + _MARGIN_M
    scale = WIDE_PX / (right - left)
    tall = (high - low) * scale
    placed = [one for one in infractions if one.kind != "outside_route_lanes"]
    legend = [f"{i}  {_LABELS[one.kind][0]}, {one.time_s:.0f} s" for i, one in enumerate(placed, 1)]
    legend += [f"{100.0 * one.share:.1f} % outside the lanes" for one in infractions if one not in placed]

    def at(x: float, y: float) -> str:
        return f"{(x - left) * scale:.1f},{_HEAD_PX + (high - y) * scale:.1f}"

    def line(points: Sequence[tuple[float, float]], style: str) -> str:
        return f'<polyline points="{" ".join(at(x, y) for x, y in points)}" fill="none" {style}/>'

    bottom = _HEAD_PX + tall + _LINE_PX * (len(legend) + 2)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDE_PX}" height="{bottom:.0f}" '
        f'viewBox="0 0 {WIDE_PX} {bottom:.0f}" font-family="sans-serif" font-size="13">',
        f'<rect width="{WIDE_PX}" height="{bottom:.0f}" fill="#ffffff"/>',
        f'<text x="10" y="22" font-size="17" font-weight="bold">{escape(title)}</text>',
        f'<text x="10" y="42" fill="#555">{escape(note)}</text>',
        f'<svg y="{_HEAD_PX}" width="{WIDE_PX}" height="{tall:.1f}" '
        f'viewBox="0 {_HEAD_PX} {WIDE_PX} {tall:.1f}" overflow="hidden">',
    ]
    for lane in road.lanes:
        points = lane.centre.points_m
        if lane.kind == "driving" and any(left < x < right and low < y < high for x, y in points):
            parts.append(line(points, f'stroke="#d8d8d8" stroke-width="{lane.width_m * scale:.1f}"'))
    way = [(one.x_m, one.y_m) for one in track.poses]
    parts.append(line(way, f'stroke="#9ecae1" stroke-width="{max(4.0, 2.4 * scale):.1f}" stroke-linecap="round"'))
    if len(path) > 1:
        parts.append(line(path, 'stroke="#08519c" stroke-width="1.6"'))
    for name, pose in (("start", track.poses[0]), ("goal", track.poses[-1])):
        x, y = at(pose.x_m, pose.y_m).split(",")
        parts.append(f'<circle cx="{x}" cy="{y}" r="5" fill="{"#2a9d8f" if name == "start" else "#264653"}"/>')
        parts.append(f'<text x="{float(x) + 8:.1f}" y="{float(y) - 6:.1f}" font-weight="bold">{name}</text>')
    for i, one in enumerate(placed, 1):
        x, y = at(one.x_m, one.y_m).split(",")
        parts.append(f'<circle cx="{x}" cy="{y}" r="9" fill="{_LABELS[one.kind][1]}" stroke="#fff"/>')
        parts.append(f'<text x="{x}" y="{float(y) + 4:.1f}" fill="#fff" font-size="11" text-anchor="middle">{i}</text>')
    parts.append("</svg>")
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
