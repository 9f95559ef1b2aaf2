"""A control process on a table: its rings, a clock made by hand, and a hand that writes wishes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from chauffeur.concept import Wishes
from chauffeur.drive.live.control import Control, Rings
from chauffeur.drive.live.messages import Observation, Report, Wish
from chauffeur.drive.live.ring import Ring
from chauffeur.drive.live.settings import SIZES, RingName
from chauffeur.drive.live.starts import Start
from chauffeur.drive.scenarios import find
from chauffeur.worlds.highway import HighwayWorld

DT_NS = 100_000_000
OVERTAKE = Start(find("overtake"), 3)


class Bench:
    """A control process on a table: its rings, its clock, and a hand that writes wishes."""

    def __init__(self, folder: Path, starts: tuple[Start, ...], speed: float = 1.0) -> None:
        self.now_ns = 1_000_000_000
        names: tuple[RingName, ...] = ("wishes", "observations", "reports")
        self.wishes, self.observations, self.reports = (Ring(folder / n, *SIZES[n], create=True) for n in names)
        self.world = HighwayWorld()
        self.control = Control(
            self.world,
            starts,
            Rings(self.wishes, self.observations, self.reports),
            speed=speed,
            clock_ns=lambda: self.now_ns,
        )
        self.speed = speed

    def tick(self) -> Report:
        self.now_ns += round(DT_NS / self.speed)
        return self.control.tick()

    def observed(self) -> Observation:
        message = self.observations.latest()
        assert message is not None
        return Observation.decode(message.payload)

    def wish(self, wanted: Wishes, **changes: object) -> None:
        seen = self.observed()
        made = Wish(seen.trip, seen.tick, "w1", self.now_ns, 1 << 62, "running", 1, wanted)
        self.wishes.write(replace(made, **changes).encode())  # pyright: ignore[reportArgumentType]
