"""Wishes in the words of passengers: an evaluation set written by hand, that no generator and no word list produced."""

from chauffeur.bench.passengers.benchmark import passengers
from chauffeur.bench.passengers.loader import PassengerWish, as_dataset, load_wishes
from chauffeur.bench.passengers.requests import PassengerRequests

__all__ = ["PassengerRequests", "PassengerWish", "as_dataset", "load_wishes", "passengers"]
