"""A drive by hand without a person: a clock that moves only when told, a real server, a real client for a page."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from websockets.asyncio.client import ClientConnection, connect

from chauffeur.bench.lampilot.human_run import HumanConfig, HumanRun
from chauffeur.hmi.wheel.server import WheelServer, serving
from chauffeur.hmi.wheel.session import WheelSession
from chauffeur.worlds.highway.dblv1 import Dataset, load_dataset
from chauffeur.worlds.highway.scenarios import BUILT_IN

PERIOD_S = 0.1
WHEN = "2026-01-02T03:04:05+00:00"
Message = dict[str, Any]

GOALS: dict[str, tuple[str, dict[str, Any], str]] = {
    "left_lc": ("overtake", {"type": "LaneChangeEval", "direction": "left"}, "Change to the left lane."),
    "dec_rel_speed4": ("cruise", {"type": "ACCEvalbySpeed", "rel_speed": -4}, "Slow down by 4 meters per second."),
    "go_straight": ("quiet-intersection", {"type": "IntersectionEval", "direction": ["il2", "o2", 0]}, "Go straight."),
}


class SteppedClock:
    """Time stands still until `advance`; whoever waits wakes exactly then."""

    def __init__(self) -> None:
        self._now_s = 100.0
        self._moved = threading.Condition()
        self._free = False

    def now_s(self) -> float:
        with self._moved:
            return self._now_s

    def wait_until(self, at_s: float) -> None:
        with self._moved:
            while self._now_s < at_s and not self._free:
                self._moved.wait()

    def advance(self, seconds: float = PERIOD_S) -> None:
        with self._moved:
            self._now_s += seconds
            self._moved.notify_all()

    def run_free(self) -> None:
        """Nobody waits any more, so that a failed test leaves no thread behind."""
        with self._moved:
            self._free = True
            self._moved.notify_all()


def dataset_of(folder: Path, *tasks: str) -> Dataset:
    """A DbLv1 folder with one item of each task."""
    folder.mkdir(parents=True, exist_ok=True)
    for task in tasks:
        place, goal, command = GOALS[task]
        scenario = next(s for s in BUILT_IN if s.id == place)
        sample = {"env": scenario.config, "eval": goal, "seed": scenario.seed}
        (folder / f"{task}.json").write_text(json.dumps({"commands": [command], "samples": [sample]}))
    return load_dataset(folder)


def run_of(folder: Path, dataset: Dataset, *, driver: str = "ana", assist: bool = False, items: int = 0) -> HumanRun:
    return HumanRun(folder, dataset, HumanConfig(driver, assist, dataset.sha256, items, 42))


class PageClient:
    """The page, as far as the server can tell."""

    def __init__(self, socket: ClientConnection, clock: SteppedClock, session: WheelSession) -> None:
        self.socket = socket
        self._clock = clock
        self._session = session
        self._number = 0
        self.item: Message = {}
        self.stage: Message = {}
        self.tick: Message = {}

    async def hear(self, until: Callable[[PageClient], bool]) -> None:
        """Read until something holds."""
        async with asyncio.timeout(60):
            while not until(self):
                message = json.loads(await self.socket.recv())
                setattr(self, message["t"], message)

    async def say(self, verb: str, **more: Any) -> None:
        await self.socket.send(json.dumps({"t": verb, **more}))

    async def press(self, keys: int) -> None:
        """Hold these keys, and know that the server has heard it."""
        self._number += 1
        await self.say("keys", k=keys, n=self._number)
        async with asyncio.timeout(20):
            while (box := self._session._mailbox) is not None and box._number < self._number:
                await asyncio.sleep(0)

    async def wish(self, verb: str) -> None:
        """Say it, and know that the server has heard it."""
        await self.say(verb)
        async with asyncio.timeout(20):
            while (box := self._session._mailbox) is not None and box._wish != verb:
                await asyncio.sleep(0)

    async def start(self) -> None:
        await self.hear(lambda page: page.stage.get("stage") == "ready")
        await self.say("start", item=self.item["id"])
        await self.until_driving()

    async def until_driving(self) -> None:
        """Through the countdown, up to the first instant that waits for keys."""
        await self.hear(lambda page: page.stage.get("stage") == "driving" and page.tick.get("phase") == "countdown")
        for _ in range(40):
            await self.press(0)
            before = self.tick
            self._clock.advance()
            await self.hear(lambda page, before=before: page.tick is not before)
            if self.tick["phase"] == "driving":
                break
        assert self.tick["phase"] == "driving"

    async def period(self, keys: int | None) -> None:
        """One control period with these keys held; None is a page that has fallen silent."""
        if keys is not None:
            await self.press(keys)
        before = (self.tick, self.stage)
        self._clock.advance()
        await self.hear(lambda page: page.tick is not before[0] or page.stage is not before[1])

    async def drive(self, keys_for: Callable[[Message], int], most: int = 700) -> Message:
        """Hold what `keys_for` says of each instant until the drive is over; the result."""
        for _ in range(most):
            if self.tick["phase"] == "over":
                break
            await self.period(keys_for(self.tick))
        await self.hear(lambda page: page.stage.get("stage") == "result" and "driven" in page.stage)
        return self.stage

    async def next(self) -> None:
        await self.say("next", item=self.item["id"])


@asynccontextmanager
async def at_the_wheel(run: HumanRun) -> AsyncGenerator[tuple[PageClient, WheelServer, SteppedClock]]:
    """A session being driven, its server, and a page connected to it."""
    clock = SteppedClock()
    session = WheelSession(run, clock, lambda: WHEN)
    async with serving(session) as server:
        driving = asyncio.create_task(session.drive_all())
        try:
            async with connect_page(server) as socket:
                yield PageClient(socket, clock, session), server, clock
        finally:
            driving.cancel()
            await asyncio.sleep(0)  # the session hears of it before time runs
            clock.run_free()
            await asyncio.gather(driving, return_exceptions=True)
            run.close()


def origin_of(server: WheelServer) -> str:
    return "http://" + server.url.split("/")[2]


def connect_page(server: WheelServer, **changed: Any) -> Any:
    """A WebSocket as the page opens it, but for what is changed."""
    address = changed.pop("address", server.url.replace("http", "ws") + "drive")
    return connect(address, **({"origin": origin_of(server)} | changed))


LEFT, RIGHT, GAS, BRAKE = 1, 2, 4, 8


class TowardsLane:
    """Keys that bring a car on a straight road to another lateral position, as a person taps them."""

    def __init__(self, shift_m: float) -> None:
        self._shift_m = shift_m
        self._goal_m: float | None = None

    def __call__(self, tick: Message) -> int:
        _, y, heading, speed, _ = tick["ego"]
        if self._goal_m is None:
            self._goal_m = y + self._shift_m
        wanted = max(-0.09, min(0.09, 0.8 * (self._goal_m - y) / speed))
        # The wheel returns by itself and goes on turning the car meanwhile.
        off = wanted - heading - 0.05 * tick["wheel"]
        return RIGHT if off > 0.004 else LEFT if off < -0.004 else 0


class TowardsSpeed:
    """Gas and brake that bring the car to a speed relative to its first, and straight on."""

    def __init__(self, change_mps: float) -> None:
        self._change_mps = change_mps
        self._goal_mps: float | None = None

    def __call__(self, tick: Message) -> int:
        speed = tick["ego"][3]
        if self._goal_mps is None:
            self._goal_mps = speed + self._change_mps
        off = self._goal_mps - speed
        return GAS if off > 0.3 else BRAKE if off < -0.3 else 0
