"""ASAM OpenDRIVE (1.4 to 1.8): the road network of a file as a `RoadGraph`, with its signals, objects and crossings.

Plane geometry in OpenDRIVE's own inertial frame (right-handed, m, rad); CARLA's is the same with y and yaw negated.
"""

from chauffeur.geometry.opendrive.network import OpenDriveMap, lane_name, parse_opendrive, read_opendrive
from chauffeur.geometry.opendrive.roadside import RoadObject, RoadSignal
from chauffeur.geometry.opendrive.values import OpenDriveError

__all__ = [
    "OpenDriveError",
    "OpenDriveMap",
    "RoadObject",
    "RoadSignal",
    "lane_name",
    "parse_opendrive",
    "read_opendrive",
]
