"""Wishes for a real vehicle: planned, checked, written down, asked of the vehicle, confirmed, remembered."""

from chauffeur.drive.onroad.answers import OnRoadAnswer
from chauffeur.drive.onroad.recorder import VehicleRecorder, open_recorder
from chauffeur.drive.onroad.session import VehicleSession

__all__ = ["OnRoadAnswer", "VehicleRecorder", "VehicleSession", "open_recorder"]
