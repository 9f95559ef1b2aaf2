"""A vandal who writes where it should not: into the shared memory of a drive, whoever else is writing there.

Writing into that folder takes the rights of the drive's own user. Control must not rely on any of it being well-formed,
timely or true.
"""

from __future__ import annotations

import json
import mmap
import os
import struct
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.driving.live.messages import MessageError, MirroredInstant
from chauffeur.driving.live.ring import Ring
from chauffeur.driving.live.settings import SIZES, RingName, ring

FORGED: Final = "forged"
"""Name of a plan that nobody made."""

_HEAD_AT: Final = 64
_EVERY_S: Final = 0.002


class Vandal:
    """Writes into the rings of a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.rings: dict[RingName, Ring] = {name: ring(folder, name) for name in SIZES}
        self.maps: dict[RingName, mmap.mmap] = {}
        for name in SIZES:
            handle = os.open(folder / name, os.O_RDWR)
            self.maps[name] = mmap.mmap(handle, 0)
            os.close(handle)
        self.kept: dict[RingName, list[bytes]] = {name: [] for name in ("setpoints", "orders")}

    def do(self, what: str, draw: int, for_s: float) -> None:
        """One deed."""
        DEEDS[what](self, np.random.default_rng(draw), for_s)

    def remember(self) -> None:
        """Keep real messages, to be played again later."""
        for name, kept in self.kept.items():
            message = self.rings[name].latest()
            if message is not None and (not kept or kept[-1] != message.payload):
                kept.append(message.payload)
                del kept[:-20]

    def garbage(self, name: RingName, rng: np.random.Generator, for_s: float) -> None:
        """Random bytes at random places, number of the newest message and form of the ring included."""
        memory = self.maps[name]
        for _ in _meanwhile(for_s):
            length = int(rng.integers(1, 4096))
            at = int(rng.integers(0, len(memory) - length))
            memory[at : at + length] = rng.bytes(length)
            if rng.random() < 0.3:
                struct.pack_into("=Q", memory, _HEAD_AT, int(rng.integers(0, 1 << 63)))

    def write(self, name: RingName, payloads: Callable[[], bytes | None], for_s: float, every_s: float) -> None:
        """Well-formed messages, numbered on from the newest."""
        for _ in _meanwhile(for_s, every_s):
            payload = payloads()
            if payload is not None and len(payload) <= SIZES[name][1]:
                self.rings[name].renew()  # garbage of its own may have left no mark to open the ring by
                with Ring(self._folder / name, *SIZES[name]) as fresh:
                    fresh.write(payload)

    def now(self) -> tuple[int, int]:
        """Trip and control period that are shown."""
        message = self.rings["observations"].latest()
        if message is None:
            return 0, 0
        try:
            shown = MirroredInstant.decode(message.payload)
        except MessageError:
            return 0, 0
        return shown.trip, shown.tick


def _meanwhile(for_s: float, every_s: float = _EVERY_S) -> Iterable[None]:
    until_s = time.monotonic() + for_s
    yield
    while time.monotonic() < until_s:
        time.sleep(every_s)
        yield


def _wish(vandal: Vandal, **changes: Any) -> bytes | None:
    """The policy's newest wish, changed."""
    trip, tick = vandal.now()
    fields: dict[str, Any] = {
        "trip": trip, "tick": tick, "plan": "", "issued_ns": time.monotonic_ns(), "expires_ns": (1 << 63) - 1,
        "state": "running", "line": 1, "speed": 20.0, "headway": 1.5, "lane": None, "turn": None, "served": [],
        "handovers": 0, "parameters": None,
    }  # fmt: skip
    newest = vandal.rings["setpoints"].latest()
    if newest is not None:
        try:
            fields |= json.loads(newest.payload)
        except (ValueError, TypeError):
            return None
    return json.dumps(fields | changes).encode()


def _nonsense(vandal: Vandal, rng: np.random.Generator) -> bytes | None:
    changes: list[dict[str, Any]] = [
        {"speed": float("nan")}, {"speed": float("inf")}, {"speed": 1e300}, {"speed": -30.0}, {"speed": "fast"},
        {"headway": float("nan")}, {"headway": -1.0}, {"headway": 10**400}, {"lane": ["c", "d", 99]}, {"lane": "left"},
        {"turn": "up"}, {"served": list(range(300))}, {"state": "flying"}, {"tick": -1}, {"tick": 1 << 70},
        {"plan": "x" * 500}, {"line": 1.5}, {"issued_ns": None}, {"expires_ns": "never"}, {"trip": True},
        {"handovers": -1}, {"handovers": "two"}, {"parameters": {"speed": -1.0}}, {"parameters": [20.0, 8.0, 2.0]},
        {"parameters": {"speed": 1e9, "ahead": float("nan"), "ratio": 1.0, "lane": 9, "route": "", "origin": None}},
    ]  # fmt: skip
    return _wish(vandal, **changes[int(rng.integers(len(changes)))])


def _forged(vandal: Vandal, rng: np.random.Generator) -> bytes | None:
    """What a policy might say that wants a crash."""
    served = list(range(40))
    return _wish(
        vandal, plan=FORGED, issued_ns=time.monotonic_ns(), tick=vandal.now()[1], trip=vandal.now()[0], speed=99.0,
        headway=0.0, state="running", served=served, turn=("left", "straight", "right")[int(rng.integers(3))],
    )  # fmt: skip


def _wishes(make: Callable[[Vandal, np.random.Generator], bytes | None], every_s: float = _EVERY_S) -> Deed:
    def deed(vandal: Vandal, rng: np.random.Generator, for_s: float) -> None:
        vandal.write("setpoints", lambda: make(vandal, rng), for_s, every_s)

    return deed


def _noise(vandal: Vandal, rng: np.random.Generator) -> bytes:
    del vandal
    return b"x" * int(rng.integers(1, 2000))


def _again(name: RingName) -> Deed:
    def deed(vandal: Vandal, rng: np.random.Generator, for_s: float) -> None:
        old = vandal.kept[name]

        def pick() -> bytes | None:
            return old[int(rng.integers(len(old)))] if old else None

        vandal.write(name, pick, for_s, _EVERY_S)

    return deed


def _flood(name: RingName, every_s: float = _EVERY_S, **fields: Any) -> Deed:
    """Messages of wishes that were never asked; of a tuple of values one is drawn each time."""

    def deed(vandal: Vandal, rng: np.random.Generator, for_s: float) -> None:
        def make() -> bytes:
            drawn = {k: v[int(rng.integers(len(v)))] if isinstance(v, tuple) else v for k, v in fields.items()}
            return json.dumps({"wish": f"x{int(rng.integers(99))}", "text": "x" * 99} | drawn).encode()

        vandal.write(name, make, for_s, every_s)

    return deed


def _orders_nonsense(vandal: Vandal, rng: np.random.Generator, for_s: float) -> None:
    """Real orders with something in them that cannot be."""

    def make() -> bytes | None:
        old = vandal.kept["orders"]
        order = json.loads(old[-1]) if old else {"plan": {}}
        bad: list[dict[str, Any]] = [
            {"scene": {"trip": 1 << 40}}, {"start_by_ns": 0, "expires_ns": 0}, {"plan": "go"},
            {"plan": order["plan"] | {"policy": None}},
            {"plan": order["plan"] | {"policy": {"kind": "program", "source": "import os", "library": ""}}},
            {"plan": order["plan"] | {"policy": {"kind": "trajectory", "waypoints_m": [[1e308, 0]], "period_s": 0}}},
        ]  # fmt: skip
        return json.dumps(order | bad[int(rng.integers(len(bad)))] | {"wish": FORGED}).encode()

    vandal.write("orders", make, for_s, 0.01)


def _frozen(vandal: Vandal, rng: np.random.Generator, for_s: float) -> None:
    """What a policy says that sees no new picture: always for the same instant, with a fresh time. The policy itself
    must stand still meanwhile."""
    del rng
    trip, tick = vandal.now()
    vandal.write("setpoints", lambda: _wish(vandal, trip=trip, tick=tick, issued_ns=time.monotonic_ns()), for_s, 0.01)


def _garbage(name: RingName) -> Deed:
    return lambda vandal, rng, for_s: vandal.garbage(name, rng, for_s)


Deed = Callable[[Vandal, np.random.Generator, float], None]
_SECOND: Final = 1_000_000_000
_ENDS: Final = ("finished", "failed", "started", "said", "garbage", "resumed")
_PLANNED: Final = ("planned", "unplanned", "declined", "planning")

DEEDS: Final[dict[str, Deed]] = {
    "wishes-garbage": _garbage("setpoints"),
    "wishes-nonsense": _wishes(_nonsense),
    "wishes-other-trip": _wishes(lambda vandal, rng: _wish(vandal, trip=int(rng.integers(1000)))),
    "wishes-future-tick": _wishes(lambda vandal, rng: _wish(vandal, tick=vandal.now()[1] + int(rng.integers(2, 999)))),
    "wishes-replayed": _again("setpoints"),
    "wishes-early-clock": _wishes(
        lambda vandal, rng: _wish(vandal, issued_ns=time.monotonic_ns() + int(rng.integers(_SECOND, 99 * _SECOND)))
    ),
    "wishes-late-clock": _wishes(
        lambda vandal, rng: _wish(
            vandal, issued_ns=max(0, time.monotonic_ns() - int(rng.integers(_SECOND, 99 * _SECOND)))
        )
    ),
    "wishes-flood": _wishes(_noise, 0.0005),
    "wishes-forged": _wishes(_forged, 0.01),
    "frozen-observation": _frozen,
    "orders-garbage": _garbage("orders"),
    "orders-nonsense": _orders_nonsense,
    "orders-replayed": _again("orders"),
    "orders-flood": _flood("orders", wish=FORGED, filler="x" * 6000),
    "requests-garbage": _garbage("requests"),
    "requests-flood": _flood("requests", person="", turn=1),
    "policy-events-garbage": _garbage("policy_events"),
    "policy-events-flood": _flood("policy_events", 0.0005, kind=_ENDS, trip=1, tick=0),
    "planner-events-garbage": _garbage("planner_events"),
    "planner-events-flood": _flood("planner_events", 0.0005, kind=_PLANNED, trip=1, tick=0),
    "checkpoints-garbage": _garbage("checkpoints"),
    "hand-garbage": _garbage("hand"),
}
"""Deeds by name."""
