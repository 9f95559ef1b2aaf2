"""Wishes for a real vehicle: planned, checked, written down, asked of the vehicle, confirmed, remembered."""

from chauffeur.drive.onroad.books import RoadBooks, open_books
from chauffeur.drive.onroad.events import Answer, Event, Status
from chauffeur.drive.onroad.session import OnRoad

__all__ = ["Answer", "Event", "OnRoad", "RoadBooks", "Status", "open_books"]
