"""Weather and light that a picture is taken in: the five conditions of the paper's Fig. 13, each in grades."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from chauffeur.concept import ConfigError
from chauffeur.concept.weather import WEATHERS, Weather

_CLEAR_M: Final = 20_000.0
_RANGES_M: Final = {"rain": (6_000.0, 450.0), "fog": (700.0, 45.0), "snow": (2_500.0, 130.0)}
"""Meteorological optical range at grades 0+ and 1: WMO's fog is below 1,000 m, dense fog below 50 m."""


@dataclass(frozen=True, slots=True)
class Conditions:
    """Weather and light; each grade 0 (none) to 1 (as bad as it is rendered). They add up: rain at night is both.

    Attributes:
        rain: Drizzle to downpour: streaks, drops on the lens, wet road, grey sky.
        fog: Mist to dense fog.
        snow: Flurries to heavy snowfall: flakes, white ground and roofs, grey sky.
        night: Dusk to a dark night with street lamps, head lamps and lit windows.
    """

    rain: float = 0.0
    fog: float = 0.0
    snow: float = 0.0
    night: float = 0.0

    def __post_init__(self) -> None:
        """Raises ConfigError for a grade outside 0 to 1."""
        for name in ("rain", "fog", "snow", "night"):
            grade = getattr(self, name)
            if not 0.0 <= grade <= 1.0:
                raise ConfigError(f"A grade of {name} of {grade} cannot be rendered.", hint="Give one from 0 to 1.")

    @classmethod
    def of(cls, weather: Weather, grade: float = 0.7, *, night: float = 0.0) -> Conditions:
        """One of the five by name and grade; `night` adds darkness to the others. Raises ConfigError.

        Of `sunny` the grade is nothing: the sky is clear.
        """
        if weather not in WEATHERS:
            raise ConfigError(f"There is no weather {weather!r}.", hint=f"Choose of: {', '.join(WEATHERS)}.")
        if weather == "sunny":
            return cls(night=night)
        if weather == "night":
            return cls(night=max(grade, night))
        return cls(**{weather: grade, "night": night})

    @property
    def weather(self) -> Weather:
        """The one of the five that decides how one drives: snow, rain or fog, whichever is worst, before night."""
        worst = max(("snow", "rain", "fog"), key=lambda name: getattr(self, name))
        if getattr(self, worst) > 0.0:
            return worst  # type: ignore[return-value]
        return "night" if self.night > 0.0 else "sunny"

    @property
    def label(self) -> str:
        """For people: e.g. `rain 0.7, night 1`."""
        given = [f"{name} {getattr(self, name):g}" for name in ("rain", "fog", "snow", "night") if getattr(self, name)]
        return ", ".join(given) or "sunny"

    @property
    def visibility_m(self) -> float:
        """Meteorological optical range by day: where a black object keeps 5 % of its contrast."""
        total = 1.0 / _CLEAR_M
        for name, (light, dense) in _RANGES_M.items():
            grade = getattr(self, name)
            if grade > 0.0:
                total += math.exp(-(math.log(light) * (1.0 - grade) + math.log(dense) * grade))
        return 1.0 / total

    @property
    def extinction(self) -> float:
        """Of light in the air, 1/m (Koschmieder: 3 / visibility for 5 % contrast)."""
        return 3.0 / self.visibility_m

    @property
    def cloud(self) -> float:
        """Cover of the sky, 0 to 1: rain, snow and fog hide the sun."""
        return min(1.0, max(2.5 * self.rain, 2.5 * self.snow, 1.6 * self.fog))

    @property
    def wet(self) -> float:
        """Wetness of the road, 0 to 1."""
        return min(1.0, 0.35 + 0.75 * self.rain) if self.rain > 0.0 else 0.0

    @property
    def lamps(self) -> bool:
        """True if vehicles drive with their head lamps on."""
        return self.night >= 0.3 or self.visibility_m < 1_500.0
