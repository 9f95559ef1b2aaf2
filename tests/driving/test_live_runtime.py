"""The processes themselves: started, driven, killed and replaced."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from chauffeur.concept import SandboxError
from chauffeur.driving.emergency import STOPPING
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.live import supervisor
from chauffeur.driving.live.messages import Report, WheelHand
from chauffeur.driving.live.plan_messages import TOOK_OVER
from chauffeur.driving.live.settings import Settings, ring
from chauffeur.driving.live.starts import Start
from chauffeur.driving.live.supervisor import Runtime
from chauffeur.driving.scenarios import find
from chauffeur.driving.trips import live_trip

STARTS = (Start(find("overtake"), 3, most_s=3_600.0),)
SETTINGS = Settings(STARTS, planner="meaning", speed=2.0, realtime=False)


class Heard:
    def __init__(self) -> None:
        self.reports: list[Report] = []
        self.events: list[DriveEvent] = []
        self.replaced: list[DriveEvent] = []

    def __call__(self, event: DriveEvent) -> None:
        match event.value:
            case Report() as report:
                self.reports.append(report)
            case None:
                self.events.append(event)
            case str():
                self.replaced.append(event)
            case _:
                pass


def until(runtime: Runtime, holds: Callable[[], bool], within_s: float = 60.0) -> None:
    end = time.monotonic() + within_s
    while not holds():
        assert time.monotonic() < end, "it did not come to pass in time"
        assert runtime.driving, "control has ended"
        runtime.poll()
        time.sleep(0.005)


def following(heard: Heard, wish: str) -> bool:
    return bool(heard.reports) and (heard.reports[-1].plan, heard.reports[-1].level) == (wish, "follow")


def test_a_wish_is_driven_while_every_other_process_is_killed_or_hangs(tmp_path: Path) -> None:
    heard = Heard()
    with Runtime(SETTINGS, heard) as runtime:
        folder = runtime.folder
        wish = runtime.ask("Slow down to 20 m/s and keep going.")
        until(runtime, lambda: following(heard, wish))
        speed = heard.reports[-1].setpoints.target_speed_mps

        before = runtime.pid("policy")
        os.kill(before, signal.SIGKILL)
        until(runtime, lambda: bool(runtime.replaced) and runtime.pid("policy") != before)
        until(
            runtime,
            lambda: any(event.kind == "resumed" for event in heard.events) or bool(runtime.interactions[wish].answer),
        )
        until(runtime, lambda: heard.reports[-1].level == "follow")

        planner = runtime.pid("planner")
        os.kill(planner, signal.SIGKILL)
        second = runtime.ask("Go back up to 25 m/s.")
        until(runtime, lambda: following(heard, second))
        assert runtime.pid("planner") != planner
        assert heard.reports[-1].setpoints.target_speed_mps != speed

        periods = len(heard.reports)
        os.kill(runtime.pid("policy"), signal.SIGSTOP)
        until(runtime, lambda: heard.replaced[-1].text == "It hung.")
        ticks = [report.tick for report in heard.reports[periods:]]
        assert len(ticks) > 2 and ticks == sorted(set(ticks)), "control went on meanwhile"
        until(runtime, lambda: heard.reports[-1].level == "follow")
        pids = [runtime.pid("control"), runtime.pid("policy"), runtime.pid("planner")]

        answer = runtime.interactions[runtime.ask("Stop!")].answer
        assert answer is not None and answer.text == STOPPING, "no planner is asked"
        end = time.monotonic() + 60.0
        while runtime.driving and time.monotonic() < end:
            runtime.poll()
            time.sleep(0.005)
        runtime.poll()
        figures = runtime.figures()
    assert all(interaction.stage == "closed" for interaction in runtime.interactions.values())
    assert figures is not None
    assert figures["scheduling"] == "default"
    assert figures["ticks"] >= len(heard.reports) > 20
    assert heard.reports[-1].outcome == "stopped"
    assert not any(report.faults for report in heard.reports)
    assert {replaced.value for replaced in heard.replaced} == {"policy", "planner"}
    assert not folder.exists()
    assert not any(Path(f"/proc/{pid}/cmdline").exists() for pid in pids)


PARKS = "Park near the stadium."
SLOWER = "Slow down to 20 m/s."


@pytest.fixture(scope="module")
def parameters(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Specification of a planner that answers with parameters."""
    policies = {
        PARKS: {"target_speed_mps": 3.5, "look_ahead_m": 5.0, "look_ahead_ratio": 1.0, "route": "stadium"},
        SLOWER: {"target_speed_mps": 20.0, "look_ahead_m": 12.0, "look_ahead_ratio": 1.0},
    }
    plans = {
        words: {"thoughts": {"text": "Yes."}, "policy": policy | {"kind": "parameters"}}
        for words, policy in policies.items()
    }
    path = tmp_path_factory.mktemp("parameters") / "answers.jsonl"
    path.write_text(
        "\n".join(json.dumps({"version": 1, "instruction": words, "plan": plan}) for words, plan in plans.items())
    )
    return f"replay/{path}"


def test_a_car_parks_in_real_time_although_the_policy_dies_on_the_way(parameters: str) -> None:
    heard = Heard()
    start = Start(find("parking-stadium"), 8, most_s=150.0)
    settings = Settings((start,), planner=parameters, speed=8.0, realtime=False)
    with Runtime(settings, heard) as runtime:
        wish = runtime.ask(PARKS)
        until(runtime, lambda: bool(heard.reports) and heard.reports[-1].plan == wish)
        os.kill(runtime.pid("policy"), signal.SIGKILL)
        until(runtime, lambda: runtime.interactions[wish].answer is not None)
        answer = runtime.interactions[wish].answer
        assert answer is not None
        assert (answer.kind, answer.text.startswith("Parked in ")) == ("finished", True)
        assert any(event.kind == "resumed" for event in heard.events)
    last = heard.reports[-1]
    assert (last.outcome, last.faults, last.refused) == ("stopped", 0, {})
    assert last.speed_mps < 0.1


def test_a_person_takes_the_wheel_and_gives_it_back_until_control_is_killed(parameters: str) -> None:
    heard = Heard()
    with Runtime(Settings(STARTS, planner=parameters, realtime=False), heard) as runtime:
        wish = runtime.ask(SLOWER)
        runtime.hand("brake")  # of somebody who does not have the wheel
        runtime.take_over(True)
        early = runtime.interactions[wish].answer
        assert early is not None
        assert (early.kind, early.text) == ("interrupted", TOOK_OVER), "what has no plan yet ends as well"
        until(runtime, lambda: bool(heard.reports) and heard.reports[-1].taken_over)
        assert heard.reports[-1].setpoints.target_speed_mps != 0.0
        runtime.take_over(False)
        until(runtime, lambda: heard.reports[-1].level == "follow")
        assert heard.reports[-1].plan == ""

        first = runtime.ask(SLOWER)
        until(runtime, lambda: following(heard, first))
        runtime.take_over(True)
        runtime.take_over(True)
        assert runtime.taken_over
        until(runtime, lambda: heard.reports[-1].taken_over and runtime.interactions[first].answer is not None)
        interaction = runtime.interactions[first]
        assert interaction.taken_over
        assert interaction.answer in heard.events
        runtime.hand("brake")
        until(runtime, lambda: heard.reports[-1].setpoints.target_speed_mps == 0.0)
        asked = runtime.ask(SLOWER)
        until(runtime, lambda: runtime.interactions[asked].answer is not None)
        answer = runtime.interactions[asked].answer
        assert answer is not None
        assert (answer.kind, answer.text) == ("interrupted", "You have the wheel.")
        runtime.take_over(False)
        until(runtime, lambda: not heard.reports[-1].taken_over)
        again = runtime.ask(SLOWER)
        until(runtime, lambda: following(heard, again))
        with ring(runtime.folder, "hand") as other:
            other.write(WheelHand(True).encode())  # of nobody: the supervisor, who knows better, says so
        until(runtime, lambda: heard.reports[-1].taken_over)
        until(runtime, lambda: not heard.reports[-1].taken_over)

        unanswered = runtime.ask(SLOWER)
        os.kill(runtime.pid("control"), signal.SIGKILL)
        end = time.monotonic() + 60.0
        while runtime.driving and time.monotonic() < end:
            time.sleep(0.01)
        runtime.poll()
        assert not runtime.driving
        assert runtime.interactions[unanswered].answer is not None
        assert runtime.figures() is None
    assert {report.level for report in heard.reports if report.taken_over} == {"hand"}
    assert heard.reports[-1].faults == 0
    trip = live_trip(interaction, STARTS[0], 0.1, heard.reports[-1])
    assert trip is not None
    assert dict(trip.record)["taken_over"] is True


def test_a_planner_that_cannot_be_had_is_said_and_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(SandboxError, match="planner process could not be started") as caught:
        Runtime(Settings(STARTS, planner="nobody"), folder=tmp_path).__enter__()
    assert "nobody" in str(caught.value.hint)


_SUPERVISOR = """
import sys, time
from pathlib import Path
from chauffeur.driving.live.settings import Settings, ring
from chauffeur.driving.live.starts import Start
from chauffeur.driving.live.supervisor import Runtime
from chauffeur.driving.scenarios import find

settings = Settings((Start(find("overtake"), 3),), planner="meaning", speed=8.0, realtime=False)
with Runtime(settings, folder=Path(sys.argv[1])) as runtime:
    print(runtime.pid("control"), runtime.pid("policy"), runtime.pid("planner"), flush=True)
    while True:
        runtime.poll()
        time.sleep(0.01)
"""


def test_without_its_supervisor_the_car_comes_to_a_stand_and_no_process_is_left(tmp_path: Path) -> None:
    parent = subprocess.Popen([sys.executable, "-c", _SUPERVISOR, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    pids = [int(pid) for pid in parent.stdout.readline().split()]
    parent.kill()
    parent.wait()
    end = time.monotonic() + 60.0
    while any(_lives(pid) for pid in pids) and time.monotonic() < end:
        time.sleep(0.05)
    assert not any(_lives(pid) for pid in pids)
    figures = json.loads((tmp_path / "punctuality.json").read_text())  # control ended in its own time, not killed
    assert figures["ticks"] > 10


def test_a_planner_that_hangs_when_the_drive_is_over_is_ended() -> None:
    code = (
        "import time; from chauffeur.driving.live.__main__ import _end_for_sure; "
        "_end_for_sure(lambda: True, 0.1); time.sleep(300)"
    )
    assert subprocess.run([sys.executable, "-c", code], timeout=600, check=False).returncode == 1


def _lives(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state != "Z"


def test_control_loads_nothing_that_plans_remembers_or_talks() -> None:
    code = (
        "import sys; import chauffeur.driving.live.control, chauffeur.driving.live.realtime, chauffeur.worlds.highway, "
        "chauffeur.driving.live.settings;"
        "print(sorted(n for n in sys.modules if n.split('.')[0] in "
        "('httpx', 'onnxruntime', 'tokenizers', 'pydantic_monty', 'torch', 'transformers')"
        " or n.startswith(('chauffeur.planners', 'chauffeur.memory', 'chauffeur.language', 'chauffeur.models', "
        "'chauffeur.describe', 'chauffeur.programs'))))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_what_a_killed_supervisor_left_in_memory_is_removed_when_it_is_old(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(supervisor, "Path", lambda path: tmp_path if path == "/dev/shm" else Path(path))
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    old, young, living = (tmp_path / f"chauffeur-{name}" for name in ("old", "young", "living"))
    for folder, owner in ((old, dead.pid), (young, dead.pid), (living, os.getpid())):
        folder.mkdir()
        (folder / "supervisor").write_text(str(owner))
        if folder is not young:
            os.utime(folder / "supervisor", (0, 0))
    idle = [sys.executable, "-c", "import time; time.sleep(60)", "chauffeur.driving.live"]
    stopped, control, of_living = (
        subprocess.Popen([*idle, role, str(folder), "1"])
        for role, folder in (("planner", old), ("control", old), ("planner", living))
    )
    stopped.send_signal(signal.SIGSTOP)
    for one in (stopped, control, of_living):  # its command can be read once it runs
        while b"chauffeur.driving.live" not in Path(f"/proc/{one.pid}/cmdline").read_bytes():
            time.sleep(0.01)
    made = supervisor._new_folder()  # pyright: ignore[reportPrivateUsage]
    assert stopped.wait(10.0) == -signal.SIGKILL
    assert control.poll() is None and of_living.poll() is None
    for one in (control, of_living):
        one.kill()
        one.wait()
    assert (made / "supervisor").read_text() == str(os.getpid())
    assert not old.exists()
    assert young.exists()
    assert living.exists()
