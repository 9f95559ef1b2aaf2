"""Plane geometry of the road: poses, polylines, boxes, the graph of lanes. The one place that projects and overlaps.

Right-handed world frame: x and y in m, headings counter-clockwise from +x in rad.
"""

from chauffeur.geometry.angles import wrap_to_pi
from chauffeur.geometry.box import Box, overlap
from chauffeur.geometry.junctions import JunctionWay, choice_ahead, named_ways, turns_ahead, way_to
from chauffeur.geometry.polyline import Polyline, joined
from chauffeur.geometry.pose import Pose
from chauffeur.geometry.road_graph import Lane, LaneId, LaneKind, LanePlace, RoadGraph, Turn
from chauffeur.geometry.route import Route, plan_route, plan_through

__all__ = [
    "Box",
    "JunctionWay",
    "Lane",
    "LaneId",
    "LaneKind",
    "LanePlace",
    "Polyline",
    "Pose",
    "RoadGraph",
    "Route",
    "Turn",
    "choice_ahead",
    "joined",
    "named_ways",
    "overlap",
    "plan_route",
    "plan_through",
    "turns_ahead",
    "way_to",
    "wrap_to_pi",
]
