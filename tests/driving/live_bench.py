"""A control process on a table: its rings, a clock made by hand, and a hand that writes wishes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from chauffeur.concept import Setpoints
from chauffeur.concept.registry import load_plugin
from chauffeur.driving.live.control import Control, Rings
from chauffeur.driving.live.messages import Key, LiveSetpoints, MirroredInstant, Report, WheelHand
from chauffeur.driving.live.ring import Ring
from chauffeur.driving.live.settings import SIZES, RingName
from chauffeur.driving.live.starts import Start
from chauffeur.driving.scenarios import find
from chauffeur.worlds.base import MirroredWorld

DT_NS = 100_000_000
OVERTAKE = Start(find("overtake"), 3)


class Bench:
    """A control process on a table: its rings, its clock, and a hand that writes wishes."""

    def __init__(self, folder: Path, starts: tuple[Start, ...], speed: float = 1.0) -> None:
        self.now_ns = 1_000_000_000
        names: tuple[RingName, ...] = ("setpoints", "observations", "reports", "hand")
        made = (Ring(folder / n, *SIZES[n], create=True) for n in names)
        self.setpoints, self.observations, self.reports, self.hand = made
        self.starts = starts
        self.world = self.new_world()
        self.control = Control(
            self.world,
            starts,
            Rings(self.setpoints, self.observations, self.reports, self.hand),
            speed=speed,
            clock_ns=lambda: self.now_ns,
        )
        self.speed = speed

    def new_world(self) -> MirroredWorld:
        """Of the kind that is driven in."""
        world: MirroredWorld = load_plugin("chauffeur.worlds", self.starts[0].scenario.world)()
        return world

    def take_over(self, on: bool, key: Key | None = None) -> None:
        """The person takes the wheel, or gives it back, or presses a key."""
        self.hand.write(WheelHand(on, key).encode(), self.now_ns)

    def tick(self) -> Report:
        self.now_ns += round(self.world.dt_s * 1e9 / self.speed)
        return self.control.tick()

    def observed(self) -> MirroredInstant:
        message = self.observations.latest()
        assert message is not None
        return MirroredInstant.decode(message.payload)

    def wish(self, wanted: Setpoints, **changes: object) -> None:
        seen = self.observed()
        made = LiveSetpoints(seen.trip, seen.tick, "w1", self.now_ns, 1 << 62, "running", 1, wanted)
        self.setpoints.write(replace(made, **changes).encode())  # pyright: ignore[reportArgumentType]
