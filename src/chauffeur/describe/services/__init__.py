"""What services and maps know of the place a car is at: weather, road and limit, traffic, local rules."""

from chauffeur.describe.services.osm_file import load_road_map
from chauffeur.describe.services.readings import Position, ServiceReading, Unknown
from chauffeur.describe.services.road_map import RoadMap
from chauffeur.describe.services.rules import load_rules, packaged_regions
from chauffeur.describe.services.settings import ServiceSettings
from chauffeur.describe.services.sources import Sources, read_sources
from chauffeur.describe.services.surroundings import Surroundings
from chauffeur.describe.services.survey import ContextServices

__all__ = [
    "ContextServices",
    "Position",
    "RoadMap",
    "ServiceReading",
    "ServiceSettings",
    "Sources",
    "Surroundings",
    "Unknown",
    "load_road_map",
    "load_rules",
    "packaged_regions",
    "read_sources",
]
