"""Optional parts of the `World` contract, found by capability: paved ground, parking spots, a town's places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from chauffeur.control.kinematic_bicycle import KinematicBicycle
from chauffeur.geometry import Box
from chauffeur.worlds.parking.lot import Spot
from chauffeur.worlds.parking.routes import Way
from chauffeur.worlds.path_follower import Chassis


@dataclass(frozen=True, slots=True)
class Destination:
    """Destination of a route through a town.

    Attributes:
        name: Of the place; empty where it has none.
        x_m, y_m: Where one stops.
        left_m: Distance by road, m.
    """

    name: str
    x_m: float
    y_m: float
    left_m: float


@runtime_checkable
class PavedGround(Protocol):
    """A world whose car may leave its lane: what is judged there is the ground."""

    @property
    def chassis(self) -> Chassis:
        """The ego's size and axles."""
        ...

    @property
    def ground(self) -> Box:
        """The paved area."""
        ...

    @property
    def steering_rate(self) -> float:
        """Steering rate of the ego, rad/s."""
        ...


@runtime_checkable
class StreetCar(Protocol):
    """A world whose car drives on streets, and that states the car: its filter foresees how it brakes and steers."""

    @property
    def car(self) -> KinematicBicycle | None:
        """The ego's size, axles, bounds, grip and lag, as they are on this trip; None where it may slide."""
        ...


@runtime_checkable
class ParkingPlaces(PavedGround, Protocol):
    """A world with parking spots."""

    def spot(self, place: str) -> Spot:
        """The free spot that is meant. Raises ScenarioError, saying why there is none."""
        ...

    def way_to(self, spot: Spot) -> Way | None:
        """The way onto a spot from here."""
        ...

    def way_on(self) -> Way:
        """The way on where no spot is meant."""
        ...

    def parked(self) -> str | None:
        """Name of the spot the ego is parked in."""
        ...


@runtime_checkable
class TownPlaces(Protocol):
    """A world with places to go to; its driver knows the way."""

    def head_for(self, place: str) -> None:
        """Set out for a place. Raises ScenarioError: there is no such place, or no way there."""
        ...

    def leave(self) -> None:
        """Drive on from a place: no goal holds the car any more."""
        ...

    def reached(self) -> str | None:
        """The place that was set out for, while the car stands there."""
        ...

    def destination(self) -> Destination | None:
        """Destination of the ego; None without one, or once it is reached."""
        ...
