"""The process that starts the others, hands wishes to the planner, and keeps account of what became of each.

It drives nothing. If it dies, control brings the car to a stand and ends; if policy or planner die, or hang, they are
replaced. No wish is left without an answer: one whose planner died, or whose plan came too late, is asked again a few
times and then given up on in words.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Literal, Self

from chauffeur.concept import NOBODY, SandboxError
from chauffeur.drive.live.__main__ import FIGURES_FILE, READY_SUFFIX
from chauffeur.drive.live.messages import MessageError, Report, Wish
from chauffeur.drive.live.orders import FINAL, Event, EventKind, Request, encode, read_event
from chauffeur.drive.live.settings import SIZES, RingName, Settings, ring

Role = Literal["control", "policy", "planner"]
ROLES: Final[tuple[Role, ...]] = ("control", "policy", "planner")

MOST_TURNS: Final = 3
SILENT_S: Final = 1.0
"""A policy that has wished nothing for so long hangs, and is replaced."""
PLANNER_SILENT_S: Final = 70.0
"""So long after a wish was sent, a planner that has said nothing hangs: its own patience ends before."""
UNSTARTED_S: Final = 5.0
"""A plan that was sent and is not heard of again so long after is lost."""
READY_WITHIN_S: Final = 60.0
FIRST_PAUSE_S: Final = 0.1
LONGEST_PAUSE_S: Final = 5.0
STOP_WITHIN_S: Final = 30.0

_HEARD: Final[tuple[RingName, ...]] = ("reports", "policy_events", "planner_events")

Stage = Literal["asked", "planned", "driven", "closed"]


@dataclass(slots=True)
class Interaction:
    """A wish and what has become of it.

    Attributes:
        request: The wish as last sent.
        stage: Where it stands.
        since_s: When it got there, by the clock.
        answer: The event that closed it.
        events: All that was told of it.
    """

    request: Request
    stage: Stage = "asked"
    since_s: float = 0.0
    answer: Event | None = None
    events: list[Event] = field(default_factory=list[Event])


@dataclass(slots=True)
class _Child:
    role: Role
    process: subprocess.Popen[bytes]
    started_s: float
    starts: int = 1
    restart_at_s: float | None = None


@dataclass(frozen=True, slots=True)
class Replaced:
    """A process that was replaced."""

    role: Role
    why: str


Listener = Callable[[Event | Report | Replaced], None]


class Runtime:
    """A drive in real time. Use as a context manager; call `poll` often."""

    def __init__(self, settings: Settings, tell: Listener | None = None, folder: Path | None = None) -> None:
        """Set up the shared memory and start the processes.

        Args:
            settings: Of the drive.
            tell: Hears events, reports of control, and which process was replaced.
            folder: For the shared memory; default a new one in `/dev/shm`, removed at the end.
        """
        self._settings = settings
        self._tell: Listener = tell or (lambda heard: None)  # noqa: ARG005
        self._own = folder is None
        memory = Path("/dev/shm")  # noqa: S108 - a new folder in it, of this user alone
        self.folder = folder or Path(
            tempfile.mkdtemp(prefix="chauffeur-", dir=memory if os.access(memory, os.W_OK) else None)
        )
        settings.write(self.folder)
        self._rings = {name: ring(self.folder, name, create=True) for name in SIZES}
        self._heard: dict[RingName, int] = dict.fromkeys(_HEARD, 0)
        self.interactions: dict[str, Interaction] = {}
        self.report: Report | None = None
        self.lost_reports = 0
        self.replaced: list[Replaced] = []
        self._children: dict[Role, _Child] = {}
        self._wish_number, self._wish_at_s = 0, time.monotonic()
        self._stopping = False
        self._doubtful: dict[str, float] = {}

    def __enter__(self) -> Self:
        try:
            self._wait_until_ready()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # For whoever drives -----------------------------------------------------------------------------------------------

    def ask(self, text: str, person: str = NOBODY) -> str:
        """Hand a wish to the planner; returns its id. What becomes of it is told by events."""
        wish = f"w{len(self.interactions) + 1}"
        self.interactions[wish] = Interaction(Request(wish, text, person), since_s=time.monotonic())
        self._send(self.interactions[wish])
        return wish

    def poll(self) -> None:
        """Hear what came, see who lives."""
        self._hear_reports()
        self._hear_events("planner_events")
        self._hear_events("policy_events")
        now_s = time.monotonic()
        self._look_after_children(now_s)
        self._look_after_wishes(now_s)

    @property
    def driving(self) -> bool:
        """Whether control still runs."""
        return self._children["control"].process.poll() is None

    @property
    def open_wishes(self) -> tuple[Interaction, ...]:
        """Wishes that have no final answer yet."""
        return tuple(each for each in self.interactions.values() if each.stage != "closed")

    def pid(self, role: Role) -> int:
        """Process id of a role, as it is now."""
        return self._children[role].process.pid

    def figures(self) -> dict[str, Any] | None:
        """Punctuality of control, once it has ended; None before, or if it was killed."""
        path = self.folder / FIGURES_FILE
        return json.loads(path.read_text()) if path.exists() else None

    def stop(self) -> None:
        """Bring the car to a stand and end; returns when control has ended."""
        self._stopping = True
        control = self._children.get("control")
        if control is not None and control.process.poll() is None:
            control.process.terminate()
            try:
                control.process.wait(STOP_WITHIN_S)
            except subprocess.TimeoutExpired:
                control.process.kill()
                control.process.wait()
        for child in self._children.values():
            if child.role != "control":
                _end(child.process)
        self._hear_reports()
        self._hear_events("planner_events")
        self._hear_events("policy_events")
        for interaction in self.open_wishes:
            self._close(interaction, Event("interrupted", interaction.request.wish, "The drive is over."))

    def close(self) -> None:
        """Stop, and give the shared memory back. May be called twice."""
        self.stop()
        for each in self._rings.values():
            each.close()
        self._rings = {}
        if self._own:
            shutil.rmtree(self.folder, ignore_errors=True)

    # Processes --------------------------------------------------------------------------------------------------------

    def _wait_until_ready(self) -> None:
        """Planner and policy first: control begins to drive when it is ready."""
        order: tuple[tuple[Role, ...], ...] = (("policy", "planner"), ("control",))
        for roles in order:
            for role in roles:
                self._start(role)
            until_s = time.monotonic() + READY_WITHIN_S
            while not all(self._ready_file(role).exists() for role in roles):
                for role in roles:
                    if self._children[role].process.poll() is not None or time.monotonic() > until_s:
                        raise SandboxError(
                            f"The {role} process could not be started.", hint=self._last_words(role) or "Try again."
                        )
                time.sleep(0.01)
        self._wish_at_s = time.monotonic()

    def _ready_file(self, role: Role) -> Path:
        return self.folder / f"{role}{READY_SUFFIX}"

    def _start(self, role: Role) -> None:
        self._ready_file(role).unlink(missing_ok=True)
        with (self.folder / f"{role}.log").open("ab") as log:
            process = subprocess.Popen(  # noqa: S603 - this package's own processes
                [sys.executable, "-m", "chauffeur.drive.live", role, str(self.folder)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
            )
        before = self._children.get(role)
        starts = 1 if before is None else before.starts + 1
        self._children[role] = _Child(role, process, time.monotonic(), starts)

    def _last_words(self, role: Role) -> str:
        lines = (self.folder / f"{role}.log").read_text(errors="replace").strip().splitlines()
        return lines[-1] if lines else ""

    def _look_after_children(self, now_s: float) -> None:
        if self._stopping or not self.driving:
            return
        policy = self._children["policy"]
        head = self._rings["wishes"].head
        if head != self._wish_number or not self._ready_file("policy").exists():
            self._wish_number, self._wish_at_s = head, now_s
        elif now_s - self._wish_at_s > SILENT_S and policy.process.poll() is None and policy.restart_at_s is None:
            policy.process.kill()
            policy.process.wait()
            self._replace(policy, "It hung.", now_s)
        helpers: tuple[Role, ...] = ("policy", "planner")
        for role in helpers:
            child = self._children[role]
            if child.restart_at_s is not None:
                if now_s >= child.restart_at_s:
                    self._start(role)
            elif (code := child.process.poll()) is not None:
                self._replace(child, f"It ended with code {code}.", now_s)

    def _replace(self, child: _Child, why: str, now_s: float) -> None:
        """Start anew: at once if it lived a while, later and later if it dies again and again."""
        lived_s = now_s - child.started_s
        pause_s = (
            0.0 if lived_s > LONGEST_PAUSE_S else min(LONGEST_PAUSE_S, FIRST_PAUSE_S * 2.0 ** min(child.starts, 8))
        )
        child.restart_at_s = now_s + pause_s
        said = Replaced(child.role, why)
        self.replaced.append(said)
        self._tell(said)
        for interaction in self.open_wishes:
            if child.role == "planner" and interaction.stage == "asked":
                interaction.since_s = -PLANNER_SILENT_S  # ask again
            elif child.role == "policy" and interaction.stage == "planned":
                interaction.since_s = -UNSTARTED_S
            elif child.role == "policy" and interaction.stage == "driven":
                self._doubtful[interaction.request.wish] = now_s

    # Wishes -----------------------------------------------------------------------------------------------------------

    def _send(self, interaction: Interaction) -> None:
        interaction.stage, interaction.since_s = "asked", time.monotonic()
        self._rings["requests"].write(encode(interaction.request))

    def _again(self, interaction: Interaction, kind: EventKind, why: str) -> None:
        """Ask for a plan again, or give up with the last answer."""
        request = interaction.request
        newer = any(
            other.request.wish != request.wish and int(other.request.wish[1:]) > int(request.wish[1:])
            for other in self.open_wishes
        )
        if newer:
            self._close(interaction, Event("superseded", request.wish, "A newer wish came."))
        elif request.turn >= MOST_TURNS or self._stopping or not self.driving:
            self._close(interaction, Event(kind, request.wish, why))
        else:
            interaction.request = Request(request.wish, request.text, request.person, request.turn + 1)
            self._send(interaction)

    def _look_after_wishes(self, now_s: float) -> None:
        for interaction in self.open_wishes:
            waited_s = now_s - interaction.since_s
            if not self.driving:
                self._close(interaction, Event("interrupted", interaction.request.wish, "The drive is over."))
            elif interaction.stage == "asked" and waited_s > PLANNER_SILENT_S:
                if self._children["planner"].restart_at_s is None and self._ready_file("planner").exists():
                    self._again(interaction, "unplanned", "The planner does not answer.")
            elif interaction.stage == "planned" and waited_s > UNSTARTED_S:
                self._again(interaction, "failed", "The plan was lost on its way to the policy.")
            elif interaction.stage == "driven":
                self._settle_doubt(interaction)

    def _settle_doubt(self, interaction: Interaction) -> None:
        """After the policy was replaced: either it goes on with the wish, or the wish ended with it."""
        wish = interaction.request.wish
        since_s = self._doubtful.get(wish)
        policy = self._children["policy"]
        if since_s is None or policy.restart_at_s is not None or policy.started_s < since_s:
            return
        message = self._rings["wishes"].latest()
        if message is None or message.written_ns * 1e-9 < policy.started_s:
            return
        try:
            goes_on = Wish.decode(message.payload).plan == wish
        except MessageError:
            return
        del self._doubtful[wish]
        if not goes_on:
            self._close(interaction, Event("interrupted", wish, "The process that drove it died."))

    def _close(self, interaction: Interaction, answer: Event) -> None:
        interaction.stage, interaction.answer = "closed", answer
        interaction.events.append(answer)
        self._tell(answer)

    # Hearing ----------------------------------------------------------------------------------------------------------

    def _hear_reports(self) -> None:
        messages, lost = self._rings["reports"].since(self._heard["reports"])
        self._heard["reports"] = max(self._heard["reports"], self._rings["reports"].head)
        self.lost_reports += lost
        for message in messages:
            self.report = Report.decode(message.payload)
            self._tell(self.report)

    def _hear_events(self, name: Literal["policy_events", "planner_events"]) -> None:
        messages, _ = self._rings[name].since(self._heard[name])
        self._heard[name] = self._rings[name].head
        for message in messages:
            try:
                event = read_event(message.payload)
            except MessageError:
                continue
            self._take(event, sent_by="policy" if name == "policy_events" else "planner")

    def _take(self, event: Event, sent_by: Role) -> None:
        interaction = self.interactions.get(event.wish)
        if interaction is None or interaction.stage == "closed":
            if interaction is None:
                self._tell(event)
            return
        if event.kind == "stale" or (event.kind == "unplanned" and sent_by == "planner"):
            interaction.events.append(event)
            self._tell(event)
            self._again(interaction, event.kind, event.text)
        elif event.kind in FINAL:
            self._close(interaction, event)
        else:
            stages: dict[EventKind, Stage] = {"planned": "planned", "started": "driven", "resumed": "driven"}
            stage = stages.get(event.kind, interaction.stage)
            if not (event.kind == "planned" and interaction.stage == "driven"):  # told by two processes, in any order
                interaction.stage = stage
            interaction.since_s = time.monotonic()
            interaction.events.append(event)
            self._tell(event)


def _end(process: subprocess.Popen[bytes]) -> None:
    """Ask a process to end, and make it."""
    if process.poll() is None:
        process.send_signal(signal.SIGCONT)
        process.terminate()
        try:
            process.wait(2.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
