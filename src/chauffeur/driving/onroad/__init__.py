"""Wishes for a real vehicle: planned, checked, written down, asked of the vehicle, confirmed, remembered."""

from chauffeur.driving.onroad.answers import OnRoadAnswer
from chauffeur.driving.onroad.recorder import VehicleRecorder, open_recorder
from chauffeur.driving.onroad.session import VehicleSession

__all__ = ["OnRoadAnswer", "VehicleRecorder", "VehicleSession", "open_recorder"]
