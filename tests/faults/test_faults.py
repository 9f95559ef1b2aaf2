"""Real drives in real processes, broken from the outside: nothing unsafe is driven, and no wish goes without an answer.

The product knows nothing of it: bad programs, signals, a vandal in the shared memory, limits of the operating system, a
clock that jumps. Endpoints that misbehave on the wire: `planners/test_llm_faults.py`; the death of the supervisor:
`driving/test_live_runtime.py`.
"""

from __future__ import annotations

import os
import resource
import signal
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from judge import Heard, judge
from vandal import DEEDS, FORGED, Vandal

from chauffeur.driving.live.messages import MessageError, Report
from chauffeur.driving.live.plan_messages import read_event
from chauffeur.driving.live.ring import Reader
from chauffeur.driving.live.settings import Settings, ring
from chauffeur.driving.live.starts import Start
from chauffeur.driving.live.supervisor import Role, Runtime
from chauffeur.driving.scenarios import find

sys.path.append(str(Path(__file__).parents[1] / "planners"))

from server import ModelServer, silent, stream

pytestmark = [pytest.mark.slow, pytest.mark.server]

WISHES = ("Slow down to 20 m/s.", "Drive 27 m/s.")
ROADS = (("overtake", 17), ("following", 3), ("overtake", 3), ("intersection", 5))
STARTS = tuple(Start(find(name), seed, most_s=25.0) for _ in range(30) for name, seed in ROADS)
WITHIN_S = 90.0


def reply(program: str, thoughts: str = "I hold the speed.") -> str:
    return f"Thoughts: {thoughts}\n\n```python\n{program}```\n"


HOLD = "def hold():\n    set_target_speed({speed})\n    while True:\n        {more}yield autopilot()\n"
GOOD = {words: reply(HOLD.format(speed=speed, more="")) for words, speed in zip(WISHES, (20.0, 27.0), strict=True)}
BAD = {
    "small talk": "I am a language model and would rather talk about the weather.",
    "unknown API": reply("def fly():\n    engage_thrusters()\n    yield autopilot()\n"),
    "an import": reply("import os\n\ndef f():\n    os.system('true')\n    while True:\n        yield autopilot()\n"),
    "never yields": reply("def hold():\n    while True:\n        n = 1\n    yield autopilot()\n"),
    "spins later": reply(
        "def hold():\n    n = 0\n    while True:\n        n = n + 1\n"
        "        while n > 8 and get_speed_of(get_ego_vehicle()) > -1.0:\n            n = n + 1\n"
        "        yield autopilot()\n"
    ),
    "dies later": reply(
        "def hold():\n    left = [1, 2, 3]\n    while True:\n        left.pop()\n        yield autopilot()\n"
    ),
    "beyond the limits": reply(HOLD.format(speed=70.0, more="set_desired_time_headway(0.05)\n        ")),
    "creeps beyond": reply(
        "def race():\n    speed = get_target_speed()\n    while True:\n        speed = speed + 1.5\n"
        "        set_target_speed(speed)\n        set_desired_time_headway(speed / 4000.0)\n        yield autopilot()\n"
    ),
    "grows": reply(
        "def hold():\n    kept = []\n    while True:\n        kept.append('x' * 400000 + str(len(kept)))\n"
        "        yield autopilot()\n"
    ),
    "talks on and on": reply(
        HOLD.format(speed=25.0, more="for i in range(150):\n            say(str(i) + 'x' * 490)\n        ")
    ),
    "long thoughts": reply(HOLD.format(speed=25.0, more=""), "1" * 8000),
}


class Drive:
    """A drive, heard and broken from the outside."""

    def __init__(self, runtime: Runtime, server: ModelServer) -> None:
        self.runtime, self.server = runtime, server
        self.vandal = Vandal(runtime.folder)
        self.trips: dict[int, list[Heard]] = defaultdict(list)
        self.plans = {"", FORGED}  # a forger is followed as the policy is: within limits and shield
        self.last: Report | None = None
        self.heard = self.lost = 0
        self._reports = Reader(ring(runtime.folder, "reports"), old=True)
        self._events = Reader(ring(runtime.folder, "policy_events"), old=True)

    def poll(self) -> None:
        self.runtime.poll()
        messages, lost = self._reports.news()
        self.lost += lost
        self.heard += len(messages)
        for message in messages:
            self.last = Report.decode(message.payload)
            self.trips[self.last.trip].append(Heard(self.last, message.written_ns))
        for message in self._events.news()[0]:
            with suppress(MessageError):
                event = read_event(message.payload)
                if event.kind in ("started", "resumed"):
                    self.plans.add(event.wish)

    def until(self, holds: Callable[[], object], what: str) -> None:
        end = time.monotonic() + WITHIN_S
        while not holds():
            assert time.monotonic() < end, f"{what}: not in time"
            assert self.runtime.driving, f"{what}: control has ended"
            self.poll()
            time.sleep(0.005)

    def go_on(self, what: str) -> None:
        """Wait until fresh wishes are followed again."""
        now = self.last
        self.until(lambda: self.last is not now and self.last is not None and self.last.level == "follow", what)

    def ask(self, what: str, text: str = "", place: int = 0) -> str:
        """Ask a wish that the model answers with a text; its name once the answer is driven, or closed."""
        words = WISHES[place % len(WISHES)]
        self.server.script(stream(text or GOOD[words]))
        wish = self.runtime.ask(words)
        self.until(lambda: self.driven(wish) or self.runtime.interactions[wish].answer is not None, what)
        return wish

    def obey(self, what: str) -> None:
        """Ask until a good answer is driven: the crossing's limit forbids it, so that trip must end first."""
        self.until(lambda: self.driven(self.ask(what, place=1)), what)

    def driven(self, wish: str) -> bool:
        return self.last is not None and (self.last.plan, self.last.level) == (wish, "follow")

    def send(self, role: Role, number: signal.Signals) -> None:
        os.kill(self.runtime.pid(role), number)

    def scribble(self, what: str, draw: int, for_s: float) -> None:
        self.vandal.remember()
        at_work = threading.Thread(target=self.vandal.do, args=(what, draw, for_s))
        at_work.start()
        self.until(lambda: not at_work.is_alive(), what)

    def judge(self) -> None:
        """Judge every trip, and look for wishes that were lost."""
        assert self.lost == 0 and self.trips
        for trip, heard in self.trips.items():
            assert [each.report.tick for each in heard] == list(range(len(heard)))
            assert judge(heard, STARTS[trip - 1], self.plans).unsafe() == (), f"trip {trip}"
        unclosed = [wish for wish, one in self.runtime.interactions.items() if one.answer is None]
        assert not unclosed


@contextmanager
def driving(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, speed: float = 2.0) -> Iterator[Drive]:
    monkeypatch.setenv("CHAUFFEUR_HOME", str(tmp_path / "home"))
    server = ModelServer()
    settings = Settings(
        STARTS,
        planner="openai/m",
        base_url=server.url,
        memory="vault",
        setting="zero-shot",
        speed=speed,
        realtime=False,
    )
    try:
        with Runtime(settings) as runtime:
            drive = Drive(runtime, server)
            drive.go_on("it starts")
            yield drive
            if runtime.driving:
                runtime.stop()
            drive.poll()
            drive.judge()
    finally:
        server.close()
    assert not runtime.folder.exists()


def test_a_model_that_writes_bad_programs(tmp_path, monkeypatch) -> None:
    with driving(tmp_path, monkeypatch) as drive:
        for place, (what, text) in enumerate(BAD.items()):
            wish = drive.ask(what, text, place)
            asked = drive.heard
            drive.until(lambda: drive.runtime.interactions[wish].answer or drive.heard > asked + 30, what)  # noqa: B023
            answer = drive.runtime.interactions[wish].answer
            follow = drive.obey if answer is not None and answer.kind == "failed" else drive.go_on
            follow(what)
        assert len(drive.plans - {"", FORGED}) > 2, "some of them pass every check, and misbehave while they are driven"
        drive.server.script(silent(WITHIN_S))
        asked = len(drive.server.requests)
        drive.runtime.ask(WISHES[0])
        drive.until(lambda: len(drive.server.requests) > asked, "the model was asked")
        drive.obey("a good answer after all")


def test_a_vandal_in_the_shared_memory(tmp_path, monkeypatch) -> None:
    with driving(tmp_path, monkeypatch) as drive:
        drive.ask("a good answer")
        for draw, what in enumerate(DEEDS):
            frozen = drive.runtime.pid("policy") if what == "frozen-observation" else 0
            if frozen:
                os.kill(frozen, signal.SIGSTOP)
            drive.scribble(what, draw, 0.15)
            if frozen:
                os.kill(frozen, signal.SIGCONT)
            drive.ask(what, place=draw)
            drive.go_on(what)
        assert drive.last is not None
        assert len(drive.last.refused) > 3, "control heard the vandal, and refused it for reasons of several kinds"


def test_processes_that_die_or_stand_still(tmp_path, monkeypatch) -> None:
    def children(pid: int) -> list[int]:
        return [
            int(one) for task in Path(f"/proc/{pid}/task").iterdir() for one in (task / "children").read_text().split()
        ]

    with driving(tmp_path, monkeypatch) as drive:
        drive.ask("a good answer")
        workers = children(drive.runtime.pid("policy"))
        assert workers
        for pid in workers:
            os.kill(pid, signal.SIGKILL)
        drive.obey("sandbox workers killed")
        for role in ("policy", "planner"):
            drive.send(role, signal.SIGSTOP)
            time.sleep(0.3)
            with suppress(ProcessLookupError):
                drive.send(role, signal.SIGCONT)
            drive.go_on(f"{role} paused")
        drive.send("spare", signal.SIGKILL)
        for role in ("policy", "planner"):
            drive.send(role, signal.SIGKILL)
            drive.ask(f"{role} killed", place=1)
            drive.go_on(f"{role} killed")
        drive.runtime.ask(WISHES[0])
        drive.send("control", signal.SIGKILL)
        end = time.monotonic() + WITHIN_S
        while drive.runtime.driving and time.monotonic() < end:
            time.sleep(0.01)
        assert not drive.runtime.driving


def test_a_disk_without_room_and_a_memory_that_is_garbage(tmp_path, monkeypatch) -> None:
    home = tmp_path / "home"
    home.mkdir()
    (home / "profiles").write_bytes(b"this is no folder")
    with driving(tmp_path, monkeypatch) as drive:
        unlimited = resource.RLIM_INFINITY
        resource.prlimit(drive.runtime.pid("planner"), resource.RLIMIT_FSIZE, (0, unlimited))
        drive.runtime.ask(WISHES[0], "ana")
        drive.ask("no byte more for the planner", place=1)
        resource.prlimit(drive.runtime.pid("planner"), resource.RLIMIT_FSIZE, (unlimited, unlimited))
        drive.ask("room again")
        drive.go_on("room again")


def test_a_wall_clock_that_jumps(tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent / "jumping"))
    with driving(tmp_path, monkeypatch) as drive:
        for place in range(4):
            drive.ask("the clock jumps", place=place)
            drive.go_on("the clock jumps")
