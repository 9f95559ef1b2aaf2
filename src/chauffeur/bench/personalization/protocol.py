"""The plan of a study with people: who makes which trip, in which order, with which system; all drawn from one seed.

Every participant first makes trips with the system that learns, and says after each how it was. Then comes, for every
scenario and level of directness, a block of three trips on the same scene, one with each system. The order of systems
within blocks is counterbalanced over participants and blocks (all six orders equally often), that of blocks and the
assignment of behaviours to levels are drawn; letters stand for systems, drawn anew for every participant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Final, Literal

import numpy as np

from chauffeur.bench.personalization.sayings import LEVELS, Level
from chauffeur.bench.personalization.scenes import GROUND_OF, Ground, Task, scenes_of
from chauffeur.concept import ConfigError

PROTOCOL_VERSION: Final = "study-protocol-v1"

PeopleArm = Literal["keyword", "without", "with"]
PEOPLE_ARMS: Final[tuple[PeopleArm, ...]] = ("keyword", "without", "with")
LETTERS: Final = ("A", "B", "C")
LEARNS: Final = "L"
"""Letter of the trips before: they are all made with the system that learns, which must not give its letter away."""

_BEHAVIOURS: Final[dict[Ground, tuple[Task, ...]]] = {
    "highway": ("overtake", "follow", "right_lane"),
    "intersection": ("yield", "go"),
    "parking": ("park",),
}
_MOST: Final = 999


@dataclass(frozen=True, slots=True)
class PlannedTrip:
    """One trip of one participant.

    Attributes:
        participant: Pseudonym.
        number: From 1, in the order in which they are made.
        phase: `learning`, or `measured`.
        block: Trips of one block are compared with one another; 0 while learning.
        task, ground, level: What is to be asked for, where, and how directly.
        scene: On which scene.
        letter: Which system, in code.
    """

    participant: str
    number: int
    phase: Literal["learning", "measured"]
    block: int
    task: Task
    ground: Ground
    level: Level
    scene: str
    letter: str

    @property
    def key(self) -> str:
        """Of its record."""
        return f"{self.participant}.{self.number:03d}"


@dataclass(frozen=True, slots=True)
class Protocol:
    """A schedule, and the key to its letters.

    Attributes:
        trips: Of all participants, in order.
        letters: System behind each (participant, letter).
    """

    trips: tuple[PlannedTrip, ...]
    letters: dict[tuple[str, str], PeopleArm]

    @property
    def participants(self) -> tuple[str, ...]:
        """Pseudonyms, in order."""
        return tuple(dict.fromkeys(trip.participant for trip in self.trips))


def make_protocol(participants: int, seed: int, learning: int) -> Protocol:
    """Draw a schedule.

    Args:
        participants: How many people.
        seed: What is drawn is drawn from it.
        learning: Trips in each scenario from which the memory learns.

    Raises:
        ConfigError: Too few or too many people, or fewer trips than none.
    """
    if not 1 <= participants <= _MOST:
        raise ConfigError(f"A study has 1 to {_MOST} participants, not {participants}.")
    if not 0 <= learning <= 50:
        raise ConfigError(f"A memory learns from 0 to 50 trips in each scenario, not {learning}.")
    orders = list(permutations(PEOPLE_ARMS))
    shuffle = np.random.default_rng([seed, 0])
    shift = [int(index) for index in shuffle.permutation(participants)]
    trips: list[PlannedTrip] = []
    letters: dict[tuple[str, str], PeopleArm] = {}
    for place in range(participants):
        name = f"P{place + 1:03d}"
        rng = np.random.default_rng([seed, 1, place])
        codes = [LETTERS[int(index)] for index in rng.permutation(len(LETTERS))]
        code_of = dict(zip(PEOPLE_ARMS, codes, strict=True))
        letters |= {(name, code): arm for arm, code in code_of.items()}
        letters[name, LEARNS] = "with"
        own = _learning(name, learning, rng)
        own += _measured(name, len(own), orders, shift[place], code_of, rng)
        trips += own
    return Protocol(tuple(trips), letters)


def _learning(name: str, count: int, rng: np.random.Generator) -> list[PlannedTrip]:
    days: list[tuple[Task, Ground, Level, str]] = []
    for ground, tasks in _BEHAVIOURS.items():
        for index in range(count):
            task = tasks[index % len(tasks)]
            scenes = scenes_of(task)
            level = LEVELS[int(rng.integers(len(LEVELS)))]
            days.append((task, ground, level, scenes[int(rng.integers(len(scenes)))].id))
    order = rng.permutation(len(days))
    return [
        PlannedTrip(name, number, "learning", 0, *days[int(index)], LEARNS)
        for number, index in enumerate(order, start=1)
    ]


def _measured(
    name: str,
    before: int,
    orders: Sequence[tuple[PeopleArm, ...]],
    shift: int,
    code_of: dict[PeopleArm, str],
    rng: np.random.Generator,
) -> list[PlannedTrip]:
    cells: list[tuple[Task, Level]] = []
    for tasks in _BEHAVIOURS.values():
        turn = int(rng.integers(len(tasks)))
        for index, level in enumerate(LEVELS):
            cells.append((tasks[(turn + index) % len(tasks)], level))
    found: list[PlannedTrip] = []
    for block, index in enumerate(rng.permutation(len(cells)), start=1):
        task, level = cells[int(index)]
        scenes = scenes_of(task)
        scene = scenes[int(rng.integers(len(scenes)))].id
        for arm in orders[(shift + block) % len(orders)]:
            number = before + len(found) + 1
            found.append(
                PlannedTrip(name, number, "measured", block, task, GROUND_OF[task], level, scene, code_of[arm])
            )
    return found


INSTRUCTIONS: Final[dict[Task, str]] = {
    "overtake": "You want to get past the car ahead.",
    "follow": "You want to stay behind the car ahead.",
    "right_lane": "You want to be in the right lane.",
    "yield": "You want the car to let others go first at the intersection.",
    "go": "You want the car to cross the intersection without waiting longer than need be.",
    "park": "You want the car to park: near the stadium, near the exit, or in the nearest spot, as you like.",
    "pace": "You want the car to drive through the lot at a speed you like.",
}
LEVEL_INSTRUCTIONS: Final[dict[Level, str]] = {
    "I": "Ask for it directly, in your own words.",
    "II": "Do not ask for it: comment on how the car drives, or on the road.",
    "III": "Do not ask for it and do not speak of the drive: only hint at how you are or what you have to do.",
}
