"""Traffic rules of a region, from a file: side of the road, units, limits where no sign stands, and a few habits.

A rule file is TOML. Speeds in it are in the unit of the region's signs. Every group of rules names its source.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints, model_validator

from chauffeur.concept import ConfigError
from chauffeur.concept.units import MPS_PER_KMH, MPS_PER_MPH
from chauffeur.describe.services.toml_file import read_file, read_text
from chauffeur.safety.screening import screen

RoadClass = Literal[
    "motorway", "motorway_link", "trunk", "trunk_link", "primary", "primary_link", "secondary", "secondary_link",
    "tertiary", "tertiary_link", "unclassified", "residential", "living_street", "service", "track", "busway", "road",
]  # fmt: skip
"""Values of OSM's `highway` tag that a car can drive on."""


def _plain(text: str) -> str:
    if screen(text, "service").findings:
        raise ValueError("reads like an instruction to a language model; say the rule in other words")
    return text


Words = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=240, pattern=r"^[^\n\"<>`]*$"),
    AfterValidator(_plain),
]  # fmt: skip
"""One line of plain words; they reach the planner."""
Speed = Annotated[float, Field(gt=0.0, le=200.0)] | Literal["none"]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, use_attribute_docstrings=True)


class ClassLimit(_Part):
    """Limits that hold on a class of road where no sign stands."""

    source: Words
    built_up: Speed | None = None
    """Where people live."""
    outside: Speed | None = None
    """Elsewhere."""


class ZoneLimits(_Part):
    """What the law says in the places that OSM names by country and kind, such as `DE:urban`."""

    source: Words
    speeds: dict[Annotated[str, StringConstraints(pattern=r"^[a-z0-9_:.\-]{1,31}$")], Speed]


class TurnOnRed(_Part):
    """Whether one may turn while the light is red."""

    rule: Literal["after_stop", "where_signed", "never"]
    way: Literal["left", "right"] | None = None
    """Which way, where it is allowed."""
    note: Words | None = None
    source: Words

    @model_validator(mode="after")
    def _which_way(self) -> Self:
        if (self.rule == "never") != (self.way is None):
            raise ValueError("`way` is `left` or `right` where a turn is allowed, and left out where it never is")
        return self


class Inside(_Part):
    """Whether one may overtake on the side of the slow lane."""

    rule: Literal["allowed", "restricted", "forbidden"]
    note: Words | None = None
    source: Words


class Following(_Part):
    """Time to keep to the vehicle ahead."""

    seconds: Annotated[float, Field(gt=0.0, le=10.0)]
    binding: bool
    """Whether it is law; otherwise it is advice."""
    source: Words


class Advisory(_Part):
    """Speed that is recommended where no limit is in force."""

    speed: Annotated[float, Field(gt=0.0, le=200.0)]
    source: Words


class Rules(_Part):
    """Rules of one region."""

    name: Annotated[Words, StringConstraints(max_length=60)]
    code: Annotated[str, StringConstraints(pattern=r"^[A-Z]{2}(-[A-Z0-9]{1,3})?$")]
    """ISO 3166 code: a country, or one of its parts."""
    as_of: Annotated[str, StringConstraints(pattern=r"^\d{4}-\d{2}$")]
    """Year and month of which the rules were collected."""
    side: Literal["left", "right"]
    side_source: Words
    unit: Literal["km/h", "mph"]
    walking_pace: Annotated[float, Field(gt=0.0, le=20.0)] = 5.0
    """What `maxspeed=walk` is taken for."""
    limits: dict[RoadClass, ClassLimit]
    zones: ZoneLimits | None = None
    advisory: Advisory | None = None
    turn_on_red: TurnOnRed
    overtaking_inside: Inside
    following: Following

    def mps(self, speed: float) -> float:
        """A speed of this file in m/s."""
        return speed * (MPS_PER_MPH if self.unit == "mph" else MPS_PER_KMH)

    def zone(self, country: str, place: str) -> Speed | None:
        """What the law says in such a place, in the unit of this file; None where this region does not know."""
        same = country.upper() in (self.code, self.code[:2])
        return self.zones.speeds.get(place) if same and self.zones is not None else None


def packaged_regions() -> tuple[str, ...]:
    """Names of the regions that come with Chauffeur."""
    folder = resources.files(__package__ or "").joinpath("regions")
    return tuple(sorted(one.name.removesuffix(".toml") for one in folder.iterdir() if one.name.endswith(".toml")))


def load_rules(region: str) -> Rules:
    """Rules of a region.

    Args:
        region: Name of one that comes with Chauffeur, or a file (a path that ends in `.toml`).

    Raises:
        ConfigError: No such region or file, or the file says something that is not understood.
    """
    if region.endswith(".toml"):
        return read_file(Rules, Path(region))
    name = region.strip().lower()
    if name not in packaged_regions():
        raise ConfigError(
            f"There are no traffic rules for a region {region!r}.",
            hint=f"Known: {', '.join(packaged_regions())}; or give a file of your own that ends in .toml.",
        )
    text = resources.files(__package__ or "").joinpath("regions", f"{name}.toml").read_text(encoding="utf-8")
    return read_rules(text, name)


def read_rules(text: str, where: str) -> Rules:
    """Rules from the text of a rule file. Raises ConfigError: It is not TOML, or not rules."""
    return read_text(Rules, text, where)
