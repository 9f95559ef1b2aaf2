"""A wish of a scene before it is put into words: the goal, the values named, and what the right answer is."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from chauffeur.concept import units

Right = Literal["drive", "refuse", "ask"]
"""Right answer of a planner: drive the goal, refuse the wish, or ask back."""

System = Literal["metric", "imperial", "informal"]


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit a person may name.

    Attributes:
        si: SI value of one.
        words: Ways of writing it behind a number, the usual ones first.
        usual: How many of `words` are usual; they are said four times in five.
        system: Which system it belongs to.
        short: For file names.
    """

    si: float
    words: tuple[str, ...]
    usual: int
    system: System
    short: str


SPEED_UNITS: dict[str, Unit] = {
    "m/s": Unit(1.0, ("meters per second", "metres per second", "m/s"), 1, "metric", ""),
    "km/h": Unit(units.MPS_PER_KMH, ("km/h", "kilometers per hour", "kph", "kilometres an hour"), 2, "metric", "kmh"),
    "mph": Unit(units.MPS_PER_MPH, ("mph", "miles per hour", "miles an hour"), 2, "imperial", "mph"),
}
DISTANCE_UNITS: dict[str, Unit] = {
    "m": Unit(1.0, ("meters", "metres", "m"), 1, "metric", ""),
    "ft": Unit(units.M_PER_FOOT, ("feet", "ft"), 1, "imperial", "ft"),
    "yd": Unit(units.M_PER_YARD, ("yards", "yd"), 1, "imperial", "yd"),
    "car lengths": Unit(units.M_PER_CAR_LENGTH, ("car lengths",), 1, "informal", "len"),
}
UNITS = SPEED_UNITS | DISTANCE_UNITS


@dataclass(frozen=True, slots=True)
class Named:
    """A quantity as the person names it: a whole number of a unit."""

    count: int
    unit: str

    @property
    def si(self) -> float:
        """SI value."""
        return self.count * UNITS[self.unit].si


@dataclass(frozen=True, slots=True)
class SceneWish:
    """A meaning to be put into words for one scene.

    Attributes:
        sections: Grammar sections it may be worded with.
        goal: Condition it is judged by (`goals`).
        origin: LaMPilot's nearest condition, written into the DbLv1 file; the same as `goal` where LaMPilot has it.
        stem: Beginning of the task file's name.
        slots: Values the templates may name: a side, or a quantity.
        right: What a good planner does.
        why: For a refusal or a question, the reason.
        change: Whether more (+1) or less (-1) of the speed or gap at the start is wished, for wishes of one number.
        means: Meanings of the words one by one, as goals: what a reader must find in them. Empty where no reading is
            asked for (see `unambiguous`).
    """

    sections: tuple[str, ...]
    goal: dict[str, Any]
    origin: dict[str, Any]
    stem: str
    slots: tuple[tuple[str, str | Named], ...] = ()
    right: Right = "drive"
    why: str = ""
    change: int = 0
    means: tuple[dict[str, Any], ...] = field(default=())
