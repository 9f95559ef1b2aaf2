"""What services and maps know of the place a car is at: weather, road and limit, traffic, local rules."""

from chauffeur.describe.services.osm_file import load_road_map
from chauffeur.describe.services.readings import Position, ServiceReading, Unknown
from chauffeur.describe.services.road_map import RoadMap
from chauffeur.describe.services.rules import load_rules, packaged_regions
from chauffeur.describe.services.sources import Sources, SourceSettings, read_sources
from chauffeur.describe.services.surroundings import Surroundings

__all__ = [
    "Position",
    "RoadMap",
    "ServiceReading",
    "SourceSettings",
    "Sources",
    "Surroundings",
    "Unknown",
    "load_road_map",
    "load_rules",
    "packaged_regions",
    "read_sources",
]
