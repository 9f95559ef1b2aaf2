"""The cases: everything about one follows from its number and the seed of the suite."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from chauffeur.bench.chaos.replies import WISHES, Road
from chauffeur.concept import Scenario
from chauffeur.drive.session import make_world
from chauffeur.worlds.highway.scenarios import BUILT_IN

SUITE_VERSION: Final = "chaos-v3"

Family = Literal["model", "process", "memory", "disk", "clock"]
Stage = Literal["before-plan", "planning", "ordered", "running", "lane-change", "junction", "end"]
Cost = Literal["light", "heavy", "outage", "fatal"]
"""Of a fault: `light`, the same processes drive the next trip at once; `heavy`, another one takes over; `outage`, one
of them has to be started anew, which takes many trips on a busy machine; `fatal`, the drive ends with it."""
Surroundings = Literal["plain", "onboard", "jumping-clock", "full-device"]
"""What all trips of a drive share: the planner (a language model on loopback, or the on-board one), a wall clock that
jumps, an audit log on a device without room."""

ANYTIME: Final[tuple[Stage, ...]] = (
    "before-plan", "planning", "ordered", "running", "running", "lane-change", "junction", "end",
)  # fmt: skip
DRIVING: Final[tuple[Stage, ...]] = (
    "running", "running", "running", "lane-change", "lane-change", "junction", "end",
)  # fmt: skip
_PLANNING: Final[tuple[Stage, ...]] = ("planning",)

TRIP_S: Final[dict[Cost, float]] = {"light": 7.5, "heavy": 15.0, "outage": 15.0, "fatal": 12.0}
CROSSING_S: Final = 24.0
"""Vehicle time of a trip: long enough for the junction."""
_TOUCHING_M: Final = 9.0


@dataclass(frozen=True, slots=True)
class FaultKind:
    """A kind of fault.

    Attributes:
        name: Stays with it.
        family: What is broken.
        stages: When it may strike.
        share: Cases of it in a round of the deck.
        cost: What becomes of the processes.
        surroundings: What the whole drive has.
    """

    name: str
    family: Family
    stages: tuple[Stage, ...] = ANYTIME
    share: int = 1
    cost: Cost = "light"
    surroundings: Surroundings = "plain"


_MODEL: Final = (
    "silent", "trickle", "cut", "bad-utf8", "bad-json", "http-500", "http-429", "endless", "empty", "chatter",
    "unknown-api", "imports", "never-yields", "spins-later", "dies-later", "beyond-limits", "creeps-beyond", "late",
    "grows", "leaps", "says-on-and-on", "wishes-on-and-on", "long-thoughts",
)  # fmt: skip
_MEMORY: Final = (
    "wishes-garbage", "wishes-torn", "wishes-nonsense", "wishes-other-trip", "wishes-future-tick", "wishes-replayed",
    "wishes-early-clock", "wishes-late-clock", "wishes-dropped", "wishes-flood", "wishes-forged", "frozen-observation",
    "orders-garbage", "orders-nonsense", "orders-replayed", "orders-flood", "requests-garbage", "requests-flood",
    "policy-events-garbage", "policy-events-flood", "planner-events-garbage", "planner-events-flood",
    "checkpoints-garbage", "hand-garbage",
)  # fmt: skip

KINDS: Final[tuple[FaultKind, ...]] = (
    *(FaultKind(f"model-{name}", "model", _PLANNING) for name in _MODEL),
    *(FaultKind(name, "memory") for name in _MEMORY),
    FaultKind("worker-killed", "process", DRIVING, 2),
    FaultKind("policy-paused", "process", ANYTIME, 2),
    FaultKind("planner-paused", "process", ANYTIME, 2),
    FaultKind("policy-killed", "process", ANYTIME, 1, "heavy"),
    FaultKind("policy-killed-twice", "process", DRIVING, 1, "outage"),
    FaultKind("policy-and-spare-killed", "process", DRIVING, 1, "outage"),
    FaultKind("policy-hangs", "process", ANYTIME, 1, "heavy"),
    FaultKind("planner-killed", "process", ANYTIME, 1, "outage"),
    FaultKind("planner-hangs", "process", ("before-plan", "planning"), 1, "outage"),
    FaultKind("scribbled-then-killed", "memory", DRIVING, 1, "outage"),
    FaultKind("control-killed", "process", ANYTIME, 1, "fatal"),
    FaultKind("supervisor-killed", "process", ANYTIME, 1, "fatal"),
    FaultKind("audit-disk-full", "disk"),
    FaultKind("planner-disk-full", "disk", ("before-plan", "planning")),
    FaultKind("profile-garbage", "disk", ("before-plan",)),
    FaultKind("audit-device-full", "disk", surroundings="full-device"),
    FaultKind("wall-clock-jumps", "clock", surroundings="jumping-clock"),
    FaultKind("onboard-worker-killed", "process", DRIVING, surroundings="onboard"),
    FaultKind("onboard-planner-paused", "process", ("before-plan", "planning"), surroundings="onboard"),
)
BY_NAME: Final = {kind.name: kind for kind in KINDS}
_ROUNDS: Final = 4
_DECK: Final = tuple(
    kind
    for round_ in range(_ROUNDS)
    for kind in KINDS
    for _ in range(kind.share)
    if kind.cost != "fatal" or round_ == 0
)
"""What ends a drive comes up less often than what does not."""


@dataclass(frozen=True, slots=True)
class ChaosCase:
    """One case.

    Attributes:
        number: In the suite.
        kind: Of fault.
        stage: When it strikes.
        scenario: Where.
        seed: Of the traffic.
        wishes: Words and the good answer of a language model, asked one after the other.
        ask_at: Control period of the first wish.
        after: Control periods from the stage's beginning to the fault.
        for_s: How long a fault that lasts does, by the clock.
        draw: Seed of what the fault itself draws.
        most_s: Length of the trip in vehicle time.
    """

    number: int
    kind: FaultKind
    stage: Stage
    scenario: Scenario
    seed: int
    wishes: tuple[tuple[str, str], ...]
    ask_at: int
    after: int
    for_s: float
    draw: int
    most_s: float

    @property
    def road(self) -> Road:
        """Kind of road."""
        return "crossing" if "intersection" in self.scenario.config["type"] else "highway"


def deck_size() -> int:
    """Cases after which every kind has come up."""
    return len(_DECK)


def kind_of(number: int, kinds: tuple[FaultKind, ...] = ()) -> FaultKind:
    """Kind of a case, out of some, or out of all for none."""
    deck = kinds or _DECK
    return deck[number % len(deck)]


def draw(number: int, first: int, kinds: tuple[FaultKind, ...] = ()) -> ChaosCase:
    """A case.

    Args:
        number: Which, from 0.
        first: Seed of the suite.
        kinds: Only these, in turn; all for none.
    """
    kind = kind_of(number, kinds)
    rng = np.random.default_rng([first, number, 23])
    stage = kind.stages[int(rng.integers(len(kind.stages)))]
    scenario, seed = _road(rng, stage)
    crossing = "intersection" in scenario.config["type"]
    known = WISHES["crossing" if crossing else "highway"]
    count = 1 + int(rng.integers(3))
    order = [int(place) for place in rng.permutation(len(known))[:count]]
    if stage == "lane-change":
        order[0] = int(rng.integers(2))  # the first wish changes lanes
    wishes = tuple(known[place] for place in dict.fromkeys(order))
    length = max(TRIP_S[kind.cost], CROSSING_S if crossing else 0.0)
    return ChaosCase(
        number=number,
        kind=kind,
        stage=stage,
        scenario=scenario,
        seed=seed,
        wishes=wishes,
        ask_at=int(rng.integers(1, 8)),
        after=int(rng.integers(0, 12)),
        for_s=float(rng.choice([0.05, 0.15, 0.3, 0.6])),
        draw=int(rng.integers(1 << 31)),
        most_s=length,
    )


def _road(rng: np.random.Generator, stage: Stage) -> tuple[Scenario, int]:
    """A road with a start that nobody could call unfair: no car touches the ego, and nobody has crashed."""
    while True:
        scenario, seed = _drawn(rng, stage)
        observation = make_world(scenario).reset(scenario, seed)
        ego = observation.ego
        near = [
            (car.x_m - ego.x_m) ** 2 + (car.y_m - ego.y_m) ** 2 < _TOUCHING_M**2
            for car in observation.others
            if abs(car.y_m - ego.y_m) < 3.0
        ]
        if not any(near) and not any(car.crashed for car in (ego, *observation.others)):
            return scenario, seed


def _drawn(rng: np.random.Generator, stage: Stage) -> tuple[Scenario, int]:
    seed = int(rng.integers(1 << 31))
    crossing = stage == "junction" or (stage != "lane-change" and rng.random() < 0.06)
    if rng.random() < 0.4:
        fitting = [one for one in BUILT_IN if ("intersection" in one.config["type"]) == crossing]
        return fitting[int(rng.integers(len(fitting)))], seed
    config: dict[str, Any]
    if crossing:
        cars = int(rng.integers(1, 6))
        config = {"type": "dt-intersection-v0", "num_vehicles_left": cars, "num_vehicles_right": cars}
    elif rng.random() < 0.5:
        lanes = int(rng.integers(3, 6))
        config = {
            "type": "dt-highway-v0", "num_lanes": lanes, "stage_length": [2000],
            "vehicles_count": int(rng.integers(8, 40)), "vehicles_density": round(float(rng.uniform(0.3, 1.4)), 2),
            "ego_vehicle": {"speed": 25, "start_lane_index": ["a", "b", 1], "start_position": [105, 0]},
        }  # fmt: skip
    else:
        lane = int(rng.integers(2))
        config = {
            "type": "ramp-merge-v0", "stage_length": [500, 80, 80, 2000],
            "vehicles_count": int(rng.integers(8, 40)), "vehicles_density": round(float(rng.uniform(0.3, 1.4)), 2),
            "ego_vehicle": {"speed": 25, "start_lane_index": ["c", "d", lane], "start_position": [105, 0]},
        }  # fmt: skip
    return Scenario("drawn", "highway", config, seed, title="drawn for the suite"), seed
