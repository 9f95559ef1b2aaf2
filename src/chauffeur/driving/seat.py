"""The view from the seat: the front camera of a simulated car, for planners that look and people who want to see."""

from __future__ import annotations

from functools import cache
from typing import Final, Protocol, runtime_checkable

from chauffeur.camera import Conditions, Renderer, front_rig, make_renderer
from chauffeur.concept import CameraImage, Observation
from chauffeur.concept.weather import Weather
from chauffeur.worlds.base import World

GRADE: Final = 0.7
"""How bad a world's weather is rendered."""


@runtime_checkable
class Weathered(Protocol):
    """A world that knows what the sky does."""

    @property
    def weather(self) -> Weather:
        """One of the five of the paper's Fig. 13."""
        ...


class SeatCamera:
    """The front camera of the ego of a world. The place around the road is the seed's; pictures are rendered."""

    def __init__(self, world: World, seed: int, weather: Weather | None = None) -> None:
        """Args: the world; seed of the place; the weather to show, the world's own if left out (sunny if it has none).

        Nothing is rendered, and no renderer made, before the first picture.
        """
        self._world, self._seed = world, seed
        self._weather: Weather | None = weather

    def take(self, observation: Observation) -> tuple[CameraImage, ...]:
        """The front camera's picture.

        Raises:
            ScenarioError: The observation has no road graph.
        """
        weather = self._weather or _weather_of(self._world)
        conditions = Conditions.of(weather, GRADE)
        return _renderer().render(observation, front_rig(), conditions, self._seed % (1 << 31)).images


def _weather_of(world: World) -> Weather:
    return world.weather if isinstance(world, Weathered) else "sunny"


@cache
def _renderer() -> Renderer:
    return make_renderer()
