"""Wishes for a real vehicle: planned, checked, written down, asked of the vehicle, confirmed, remembered."""

from chauffeur.drive.onroad.answers import OnRoadAnswer, Status
from chauffeur.drive.onroad.books import RoadBooks, open_books
from chauffeur.drive.onroad.session import OnRoad

__all__ = ["OnRoad", "OnRoadAnswer", "RoadBooks", "Status", "open_books"]
