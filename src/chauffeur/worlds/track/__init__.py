"""A test track: CommonRoad's vehicle models, a lead vehicle, the three manoeuvres of the paper's Sec. VI-C,
and streets for short drives (Sec. VII-C)."""

from chauffeur.worlds.track.manoeuvres import FRICTION, MANOEUVRES
from chauffeur.worlds.track.referee import StreetReferee, end_of, peak_of
from chauffeur.worlds.track.scenarios import BUILT_IN, track_scenario
from chauffeur.worlds.track.world import TrackWorld

__all__ = [
    "BUILT_IN",
    "FRICTION",
    "MANOEUVRES",
    "StreetReferee",
    "TrackWorld",
    "end_of",
    "peak_of",
    "track_scenario",
]
