"""A route on the map of its town as one SVG: the way, what was driven of it, and where rules were broken."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Final

from chauffeur.bench.leaderboard.criteria import Infraction, InfractionKind
from chauffeur.bench.leaderboard.track import RouteTrack
from chauffeur.geometry import RoadGraph

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
