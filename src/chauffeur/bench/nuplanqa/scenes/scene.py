"""A clip and what is true of it, wherever it comes from: what questions are asked about."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept.scene import AgentKind, Observation, SignalState

SAMPLES: Final = 5
STEP_S: Final = 0.5
"""Instants of a clip: five, half a second apart, the last one now."""
FAST_MPS: Final = 14.5
"""Above it the ego's speed tells what kind of road it is on, and nothing that hangs on the road is asked."""

LEFT_TAKEN_M: Final = 50.0
"""A vehicle this near in the lane on the left is in the way of passing there."""

Motion = Literal["still", "steady", "faster", "slower"]
Sky = Literal["clear day", "rainy day", "foggy day", "snowy day", "clear night", "rainy night"]
SKIES: Final[tuple[Sky, ...]] = (
    "clear day",
    "rainy day",
    "foggy day",
    "snowy day",
    "clear night",
    "rainy night",
)
RoadKind = Literal["highway", "street", "crossing", "lot"]
"""One-way without a junction, two-way without one, before a junction, among parking spots."""
Layout = Literal["straight", "left", "right", "junction"]


@dataclass(frozen=True, slots=True)
class QaUser:
    """A road user that questions are about.

    Attributes:
        id: Its id in the observations.
        kind: What it is.
        ahead_m: How far ahead of the ego its middle is from the ego's, along the road; negative behind it.
    """

    id: int
    kind: AgentKind
    ahead_m: float


@dataclass(frozen=True, kw_only=True)
class QaScene:
    """A clip and what is true of it.

    Attributes:
        token: Its name, 16 hexadecimal digits.
        source: Where it comes from, e.g. `staged street`, `town Oldbridge`; for the breakdown by kind of scene.
        kind: Of the road.
        lanes: In the ego's direction.
        own: The ego's among them, 0 leftmost.
        layout: How the road goes on.
        motion: Of the ego.
        sky: Weather and light.
        light: What the ego's traffic light shows; None without one.
        light_id: Its id in the observations.
        left_taken: Whether a vehicle is farther ahead in the lane on the left, and passing is a matter of opinion.
        lead, left, right, behind: Vehicle ahead in the ego's lane, beside it on either side, behind it; None for none.
        walker: Pedestrian on the road ahead; None for none.
        walker_from: From which side they come.
        ahead: Vehicles wholly ahead of the ego in its direction.
        unclear: Families of questions that are not asked, as two answers could be called right; `lead` stands for all
            that hang on who is ahead.
        instants: Observations, oldest first.
    """

    token: str
    source: str
    kind: RoadKind
    lanes: int
    own: int
    layout: Layout
    motion: Motion
    sky: Sky
    light: SignalState | None
    light_id: str = ""
    left_taken: bool = False
    lead: QaUser | None
    left: QaUser | None
    right: QaUser | None
    behind: QaUser | None
    walker: QaUser | None
    walker_from: Literal["left", "right"] = "left"
    ahead: tuple[QaUser, ...]
    unclear: frozenset[str] = frozenset()
    instants: tuple[Observation, ...]

    @property
    def now(self) -> Observation:
        """The instant that is asked about."""
        return self.instants[-1]

    @property
    def scene_type(self) -> str:
        """For the breakdown by kind of scene; says that it is simulated."""
        return f"simulated {self.source}"

    @property
    def fast(self) -> bool:
        """True if the ego's speed tells what kind of road it is on."""
        return max(one.ego.speed_mps for one in self.instants) > FAST_MPS

    @property
    def speeds_mps(self) -> tuple[float, ...]:
        """The ego's speed at each instant, as the questions quote it."""
        return tuple(round(one.ego.speed_mps, 3) for one in self.instants)

    @property
    def steering_deg(self) -> tuple[float, ...]:
        """Angle of its front wheels at each instant, degrees."""
        return tuple(round(math.degrees(one.ego.steering_rad), 3) for one in self.instants)
