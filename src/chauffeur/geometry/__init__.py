"""Plane geometry of the road: poses, polylines, boxes, the graph of lanes. The one place that projects and overlaps.

Right-handed world frame: x and y in m, headings counter-clockwise from +x in rad.
"""

from chauffeur.geometry.angles import wrap_to_pi
from chauffeur.geometry.box import Box, overlap
from chauffeur.geometry.polyline import Polyline, joined
from chauffeur.geometry.pose import Pose
from chauffeur.geometry.road_graph import Lane, LaneId, LaneKind, LanePlace, RoadGraph, Turn
from chauffeur.geometry.route import Route, plan_route

__all__ = [
    "Box",
    "Lane",
    "LaneId",
    "LaneKind",
    "LanePlace",
    "Polyline",
    "Pose",
    "RoadGraph",
    "Route",
    "Turn",
    "joined",
    "overlap",
    "plan_route",
    "wrap_to_pi",
]
