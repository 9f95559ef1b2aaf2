"""The road of a trip as the page draws it: surfaces and painted lines, in metres, with y downwards as on a screen."""

from __future__ import annotations

from typing import Any

from chauffeur.concept import Lane, RoadGraph
from chauffeur.drive.talk.messages import Road
from chauffeur.geometry import Polyline
from chauffeur.hmi.road import Bounds, draw_road

_MARGIN_M = 20.0
_ON_FOOT = ("sidewalk", "crossing")


def drawn(road: Road) -> dict[str, Any]:
    """As a JSON object: the lanes as they were told, and what is painted on them."""
    lanes = tuple(
        Lane(
            lane.id,
            Polyline.of((x, -y) for x, y in lane.centre_m),
            lane.width_m,
            0.0,
            kind="emergency" if lane.shoulder else lane.what,
            road=lane.road,
            index=lane.index,
            junction=lane.junction,
        )
        for lane in road.lanes
    )
    xs = [x for lane in lanes for x, _ in lane.centre.points_m]
    ys = [y for lane in lanes for _, y in lane.centre.points_m]
    everything = Bounds(min(xs, default=0.0), min(ys, default=0.0), max(xs, default=0.0), max(ys, default=0.0))
    painted = draw_road(RoadGraph(lanes), (), everything.grown(_MARGIN_M))
    return {
        "kind": road.kind,
        "world": road.world,
        "lanes": [
            {
                "id": lane.id,
                "p": _flat(lane.centre.points_m),
                "w": lane.width_m,
                "road": lane.road,
                "i": lane.index,
                "e": lane.emergency,
            }
            for lane in lanes
            if lane.kind not in _ON_FOOT
        ],
        "surfaces": [{"p": _flat(s.centre_m), "w": s.width_m, "e": s.emergency} for s in painted.surfaces],
        "lines": [{"p": _flat(line.points_m), "s": line.style} for line in painted.lines],
        "bars": [_flat(bar) for bar in painted.bars_m],
    }


def _flat(points: tuple[tuple[float, float], ...]) -> list[float]:
    return [round(value, 2) for point in points for value in point]
