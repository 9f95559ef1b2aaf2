"""What the processes of a drive are told when they start, and the memory that joins them."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal

from chauffeur.concept import Limits, Scenario
from chauffeur.driving.live.ring import Ring
from chauffeur.driving.live.starts import Start

SETTINGS_FILE: Final = "settings.json"

RingName = Literal[
    "observations",
    "reports",
    "setpoints",
    "orders",
    "briefs",
    "requests",
    "policy_events",
    "planner_events",
    "checkpoints",
    "hand",
]
SIZES: Final[dict[RingName, tuple[int, int]]] = {
    "observations": (4, 64 << 10),
    "reports": (512, 16 << 10),
    "setpoints": (8, 8 << 10),
    "orders": (8, 256 << 10),
    "briefs": (8, 512 << 10),
    "requests": (16, 16 << 10),
    "policy_events": (256, 16 << 10),
    "planner_events": (256, 16 << 10),
    "checkpoints": (2, 1 << 20),
    "hand": (64, 128),
}
"""Messages kept, and most bytes of one. The person's `hand` is written by the supervisor and read by control alone."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Of one drive.

    Attributes:
        starts: The trips.
        planner: Specification of the planner.
        base_url: Endpoint of a planner that is served.
        memory: Name of the memory, empty for none.
        services: File of the services that C is completed from, empty for none.
        setting: Whether prompts carry examples.
        speed: Vehicle time per time of the clock.
        realtime: Whether control asks for real-time scheduling.
    """

    starts: tuple[Start, ...]
    planner: str = "onboard"
    base_url: str | None = None
    memory: str = ""
    services: str = ""
    setting: str = "few-shot"
    speed: float = 1.0
    realtime: bool = True

    def write(self, folder: Path) -> None:
        """Into a folder, for the other processes."""
        (folder / SETTINGS_FILE).write_text(json.dumps(asdict(self)))

    @classmethod
    def read(cls, folder: Path) -> Settings:
        """From the folder."""
        fields: dict[str, Any] = json.loads((folder / SETTINGS_FILE).read_text())
        fields["starts"] = tuple(
            Start(Scenario(**start["scenario"]), start["seed"], Limits(**start["limits"]), start["most_s"])
            for start in fields["starts"]
        )
        return cls(**fields)


def ring(folder: Path, name: RingName, *, create: bool = False) -> Ring:
    """A ring of the drive in a folder."""
    return Ring(folder / name, *SIZES[name], create=create)
