"""Traffic of a town: vehicles of all kinds, each on an endless route of its own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from chauffeur.worlds.town.sumo import MAKES, Sumo

if TYPE_CHECKING:
    from numpy.random import Generator

DENSITY_PER_KM: Final = 8.0
"""Vehicles per km of lane at most: above that, small towns stand still (see docs/town.md)."""
STUCK_PERIODS: Final = 2400
"""Periods (120 s) without progress after which a car is taken out, and put in elsewhere: CARLA clears jams alike."""
_NOWHERE_M: Final = 20.0
"""Two cars' lengths a cycle of the lights and less is no queue but a jam, which spreads over a small town."""
_WAY_M: Final = 1200.0
_FEW: Final = 3
_EVERY: Final = 40
"""Interval, in periods, of looking at an agent's way."""


class Traffic:
    """Keeps a town's traffic going."""

    def __init__(self, sumo: Sumo, count: int, rng: Generator) -> None:
        """Let so many vehicles set out, fewer where the town has no room for them."""
        self._sumo, self._rng = sumo, rng
        self._edges = sumo.edges()
        self._lengths = {edge: sumo.length_m(edge) for edge in self._edges}
        lanes_km = sum(self._lengths[edge] * sumo.lanes_of(edge) for edge in self._edges) / 1000.0
        self.count = min(count, round(DENSITY_PER_KM * lanes_km))
        self._names = list(self._lengths)
        self._weights = _shares([self._lengths[edge] for edge in self._names])
        self._makes = list(MAKES)
        self._make_shares = _shares([MAKES[make].share for make in self._makes])
        self._vehicles: list[str] = []
        self._number = 0
        self._moved: dict[str, tuple[int, float]] = {}
        self._tick = 0
        if self._edges:
            for _ in range(self.count):
                self._set_out()

    def mind(self) -> None:
        """Replace who is gone, and give who has nearly arrived another way."""
        for name in self._sumo.gone():
            if name in self._vehicles:
                self._sumo.remove(name)
                self._vehicles.remove(name)
                self._set_out()
        self._tick += 1
        for name in self._vehicles[self._tick % _EVERY :: _EVERY]:
            if self._stuck(name):
                self._sumo.remove(name)
                self._vehicles.remove(name)
                self._moved.pop(name, None)
                self._set_out()
                break
            route = self._sumo.route_of(name)
            if 0 < len(route) <= _FEW and route[-1] in self._edges:
                self._sumo.go_on(name, [*route[:-1], *self._way(route[-1])])

    def _stuck(self, name: str) -> bool:
        """True if an agent has got nowhere for longer than any red light lasts."""
        driven = self._sumo.driven_m(name)
        since, before = self._moved.get(name, (self._tick, driven))
        if driven - before > _NOWHERE_M:
            since, before = self._tick, driven
        self._moved[name] = since, before
        return self._tick - since > STUCK_PERIODS

    def _set_out(self) -> None:
        self._number += 1
        name = f"v{self._number}"
        make = self._makes[_drawn(self._rng, self._make_shares)]
        self._sumo.add(name, make, self._way(self._names[_drawn(self._rng, self._weights)]))
        self._vehicles.append(name)

    def _way(self, edge: str) -> list[str]:
        way, length = [edge], self._lengths[edge]
        while length < _WAY_M:
            ways = self._edges[way[-1]]
            onward = [one for one in ways if one.lstrip("-") != way[-1].lstrip("-")] or ways
            if not onward:
                break
            way.append(onward[int(self._rng.integers(len(onward)))])
            length += self._lengths[way[-1]]
        return way


def _shares(weights: Sequence[float]) -> list[float]:
    """Running sums of weights, the last one 1."""
    total, so_far, found = sum(weights), 0.0, list[float]()
    for weight in weights:
        so_far += weight / total
        found.append(so_far)
    return found


def _drawn(rng: Generator, shares: Sequence[float]) -> int:
    value = rng.random()
    return next((i for i, share in enumerate(shares) if value < share), len(shares) - 1)
