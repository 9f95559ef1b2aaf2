"""The ViLaD planner (paper Sec. VII): masked diffusion over a fixed pattern.

In a parking lot a wish becomes a spot; on a road a command becomes the waypoints of a short drive.
"""

from __future__ import annotations

import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from chauffeur.concept import (
    Alarm,
    InstructionError,
    Parameters,
    ParkingLot,
    Plan,
    PlanRequest,
    Street,
    Usage,
)
from chauffeur.language.corrections import last_said
from chauffeur.planners.base import declined, planned
from chauffeur.planners.onboard.town import town_destination
from chauffeur.planners.onboard.town_steps import landmark_in
from chauffeur.planners.vilad.driving import TEMPLATE as DRIVE
from chauffeur.planners.vilad.driving import asked_of_drive
from chauffeur.planners.vilad.driving_planning import (
    HOW_DRIVEN,
    drive_words,
    intent_of,
    refusal_of,
    trajectory_of,
    write_drive,
)
from chauffeur.planners.vilad.engine import SHIPPED_DRIVE, ViladEngine, shipped
from chauffeur.planners.vilad.parking import (
    CRITERIA,
    LANDMARKS,
    NONE,
    ROWS,
    TEMPLATE,
    WIDTH,
    asked_of,
    free_spots,
    in_words,
    verified,
)
from chauffeur.planners.vilad.unmasking import Unmasking, unmask
from chauffeur.safety.dangers import danger

SPEED_MPS: Final = 3.0
"""In a parking lot, where ways are narrow."""
LOOK_AHEAD_M: Final = 4.0
LOOK_AHEAD_S: Final = 1.0
HOW: Final = Unmasking(steps=13, tau=0.9)
"""Thirteen decisions, at most one a step; what is more certain than 0.9 is decided at once."""
_NAMED: Final = re.compile(r"\b([A-La-l])\s?(\d{1,2})\b")


class ViladPlanner:
    """Words and a lot's free spots to `Parameters` that name a spot; words and the street ahead to a `Trajectory`."""

    def __init__(
        self, parking: ViladEngine | None = None, driving: ViladEngine | None = None, how: Unmasking | None = None
    ) -> None:
        """Args: the networks, those that ship by default; how they are unmasked, each in its own way by default."""
        self._parking, self._driving, self._how = parking, driving, how

    @classmethod
    def from_spec(cls, argument: str) -> ViladPlanner:
        """`vilad`, or `vilad/<folder>` for a model of one's own, of either task. Raises DataError where it cannot be
        read."""
        if not argument:
            return cls(parking=shipped())
        engine = ViladEngine(Path(argument))
        return cls(driving=engine) if engine.version.startswith("vilad-drive") else cls(parking=engine)

    @property
    def id(self) -> str:
        """Registry name."""
        return "vilad"

    @property
    def model(self) -> str:
        """Version of the network."""
        if self._driving is not None and self._parking is None:
            return self._driving.version
        return self._parking_engine.version

    @property
    def _parking_engine(self) -> ViladEngine:
        return shipped() if self._parking is None else self._parking

    @property
    def _driving_engine(self) -> ViladEngine:
        return shipped(SHIPPED_DRIVE) if self._driving is None else self._driving

    async def plan(self, request: PlanRequest) -> Plan:
        """One plan; declined where there is neither a lot nor a street, and for what cannot or must not be done there.

        Raises:
            InstructionError: The wish is empty.
        """
        begun = time.perf_counter()
        text = request.instruction.text.strip()
        if not text:
            raise InstructionError("The instruction is empty.", hint="Say where to park, or where to drive.")
        text = last_said(text)
        if request.context.lot is not None:
            return self._park(request, request.context.lot, text, begun)
        if request.context.street is not None:
            return self._drive(request, request.context.street, text, begun)
        words = "I choose parking spots and write short drives; here is neither a parking lot nor a street that I know."
        return declined(self, words, begun, intent="declined")

    def _drive(self, request: PlanRequest, street: Street, text: str, begun: float) -> Plan:
        engine = self._driving_engine
        if why := danger(text):
            return declined(self, why, begun, intent="declined")
        if request.context.situation.world == "town" and landmark_in(town_destination(text)):
            words = "I write the next few seconds on the road, and the way there is longer. Say where to turn next."
            return declined(self, words, begun, intent="declined")
        written = write_drive(engine, text, street, self._how or HOW_DRIVEN)
        usage = Usage(completion_tokens=len(DRIVE.slots), requests=written.decided.passes)
        asked = asked_of_drive(written.values)
        if written.values["way"] == 0:
            words = refusal_of(street, written.values)
            refused = declined(self, words, begun, intent=intent_of(asked), usage=usage, raw=written.raw)
            anywhere = all(asked[name] == NONE for name in ("mark", "place", "metres", "turn"))
            alarm: Alarm = "stop" if asked["halt"] == "stop" and anywhere else ""
            return replace(refused, model=engine.version, alarm=alarm)
        limit = request.context.situation.speed_limit_mps
        return planned(
            self,
            drive_words(street, written.values),
            trajectory_of(street, written.values, request.limits, limit),
            begun,
            intent=intent_of(asked),
            model=engine.version,
            settings=(("passes", float(written.decided.passes)), ("agreed", float(written.agreed))),
            usage=usage,
            raw=written.raw,
        )

    def _park(self, request: PlanRequest, lot: ParkingLot, text: str, begun: float) -> Plan:
        named = _named(text, lot)
        taken = [name for name, free in named.items() if not free]
        if named and len(taken) == len(named):
            return declined(self, f"Spot {taken[0]} is taken.", begun, intent="park")
        spots, names = free_spots(lot, [name for name in named if name not in taken])
        if not names:
            return declined(self, "There is no free spot.", begun, intent="park")
        features = spots.features()
        predict = self._parking_engine.predict(text, features)
        raw = unmask(predict, TEMPLATE.canvas, TEMPLATE.allowed(len(features)), self._how or HOW)
        decided = verified(predict, spots, raw)
        agreed = decided is raw
        TEMPLATE.validate(decided.row, candidates=len(spots) + 1)
        values = TEMPLATE.decode(decided.row)
        written = TEMPLATE.text(raw.row)
        asked = asked_of(values)
        missing = _missing(asked, lot)
        candidate = int(values["spot"])
        if named:  # whoever names a spot has said what they want; the network is not asked to doubt it
            candidate, said = max(candidate, 1), f"You named {names[max(candidate, 1) - 1]}, and it is free."
        elif not any(asked[name] != NONE for name in LANDMARKS) and (why := danger(text)):
            # Near a place is near no danger: "as close as you can get to the lift" is no tailgating in a lot.
            return declined(self, why, begun, intent="park", usage=_usage(decided.passes), raw=written)
        elif candidate == 0:
            words = f"No free spot is {in_words(asked)}."
            return declined(self, words, begun, intent="park", usage=_usage(decided.passes), raw=written)
        else:
            said = f"You want a spot {in_words(asked)}{missing}. {names[candidate - 1]} is the best of the free ones."
        name = names[candidate - 1]
        speed = min(SPEED_MPS, request.limits.most_mps(request.context.situation.speed_limit_mps))
        return planned(
            self,
            f"{said} I drive there at {speed:.1f} m/s.",
            Parameters(speed, LOOK_AHEAD_M, LOOK_AHEAD_S, route=name),
            begun,
            intent="park",
            model=self._parking_engine.version,
            settings=(("target_speed_mps", speed), ("passes", float(decided.passes)), ("agreed", float(agreed))),
            usage=_usage(decided.passes),
            raw=written,
        )


def parking_wish(text: str) -> dict[str, str]:
    """Criteria that a wish states for a parking spot: the reading of the shipped network, on no lot."""
    nothing = np.zeros((2, WIDTH), np.float32)
    nothing[0, WIDTH - len(ROWS) - 1] = 1.0
    decided = shipped().decide(TEMPLATE, last_said(text), nothing, HOW)
    return asked_of(TEMPLATE.decode(decided.row))


def _usage(passes: int) -> Usage:
    return Usage(completion_tokens=len(CRITERIA) + 2, requests=passes)


def _named(text: str, lot: ParkingLot) -> Mapping[str, bool]:
    """Spots of the lot that a wish names, and whether each is free."""
    free = {spot.name: spot.free for spot in lot.spots}
    said = [f"{letter.upper()}{int(number)}" for letter, number in _NAMED.findall(text)]
    return {name: free[name] for name in said if name in free}


def _missing(asked: Mapping[str, str], lot: ParkingLot) -> str:
    there = {name for name, _, _ in lot.landmarks}
    absent: Sequence[str] = [name for name in LANDMARKS if asked[name] != NONE and name not in there]
    return f" (there is no {' and no '.join(absent)} here)" if absent else ""
