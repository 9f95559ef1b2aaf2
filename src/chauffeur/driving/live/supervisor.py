"""The process that starts the others, hands wishes to the planner, and keeps account of what became of each.

It drives nothing. If it dies, control brings the car to a stand and ends; if policy or planner die, or hang, they are
replaced. No wish is left without an answer: one whose planner died, or whose plan came too late, is asked again a few
times and then given up on in words.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Literal, Self

from chauffeur.concept import NOBODY, SandboxError, Verdict
from chauffeur.driving.emergency import STOPPING, stop_wanted
from chauffeur.driving.events import FINAL, DriveEvent, EventKind, Listener, nobody_listens
from chauffeur.driving.judge.account import result_of_event
from chauffeur.driving.live.__main__ import FIGURES_FILE, READY_SUFFIX
from chauffeur.driving.live.messages import Key, LiveSetpoints, MessageError, Report, WheelHand
from chauffeur.driving.live.plan_messages import (
    TOOK_OVER,
    PlanningInputs,
    Request,
    encode,
    read_brief,
    read_event,
)
from chauffeur.driving.live.ring import Reader, RingMessage
from chauffeur.driving.live.settings import SIZES, RingName, Settings, ring
from chauffeur.language.emergency import read_emergency
from chauffeur.language.meaning.words import wish_words

Role = Literal["control", "policy", "spare", "planner"]
"""`spare`: a policy process that waits to take over."""

MOST_TURNS: Final = 3
SILENT_S: Final = 1.0
"""A policy that has wished nothing for so long hangs, and is replaced."""
PLANNER_SILENT_S: Final = 70.0
"""So long after a wish was sent, a planner that has said nothing hangs: its own patience ends before."""
UNHEARD_S: Final = 10.0
"""A planner that has not taken a wish up so long after it was sent did not hear it, or hangs."""
UNSTARTED_S: Final = 5.0
"""A plan that was sent and is not heard of again so long after is lost."""
UNHANDED_S: Final = 0.5
"""Control is told again who has the wheel where it does not know so long after."""
READY_WITHIN_S: Final = 120.0
FIRST_PAUSE_S: Final = 0.1
LONGEST_PAUSE_S: Final = 5.0
SPARE_PAUSE_S: Final = 1.0
"""A new spare is started so long after one was called: the one that took over comes first."""
STOP_WITHIN_S: Final = 30.0
FOLDER_PREFIX: Final = "chauffeur-"
OWNER_FILE: Final = "supervisor"
_MODULE: Final = b"chauffeur.driving.live"
LEFT_FOR_S: Final = 120.0
"""A folder whose supervisor is gone, and which nobody has written to for so long, is removed."""

_HEARD: Final[tuple[RingName, ...]] = ("reports", "policy_events", "planner_events", "briefs")

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
        brief: What its last plan was made of; None before there is one.
    """

    request: Request
    stage: Stage = "asked"
    since_s: float = 0.0
    answer: DriveEvent | None = None
    events: list[DriveEvent] = field(default_factory=list[DriveEvent])
    brief: PlanningInputs | None = None

    @property
    def started_tick(self) -> int | None:
        """When driving it began; None if it never did."""
        return next((event.tick for event in self.events if event.kind in ("started", "resumed")), None)

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """V: of each check the newest."""
        told = (event.value for event in self.events if isinstance(event.value, tuple))
        found = {one.check: one for several in told for one in several if isinstance(one, Verdict)}
        return tuple(sorted(found.values(), key=lambda one: not one.vetoes))

    @property
    def taken_over(self) -> bool:
        """Whether it ended because the person took the wheel."""
        return self.answer is not None and self.answer.kind == "interrupted" and self.answer.text == TOOK_OVER


@dataclass(slots=True)
class _Child:
    role: Role
    process: subprocess.Popen[bytes]
    started_s: float
    starts: int = 1
    restart_at_s: float | None = None


class Runtime:
    """A drive in real time. Use as a context manager; call `poll` often."""

    def __init__(self, settings: Settings, tell: Listener = nobody_listens, folder: Path | None = None) -> None:
        """Set up the shared memory and start the processes.

        Args:
            settings: Of the drive.
            tell: Hears what becomes of wishes, what plans are made of, control periods, and replaced processes.
            folder: For the shared memory; default a new one in `/dev/shm`, removed at the end.
        """
        self._tell = tell
        self._own = folder is None
        self.folder = _new_folder() if folder is None else folder
        settings.write(self.folder)
        self._settings = settings
        self._rings = {name: ring(self.folder, name, create=True) for name in SIZES}
        self._heard = {name: Reader(self._rings[name], old=True) for name in _HEARD}
        self.interactions: dict[str, Interaction] = {}
        self.report: Report | None = None
        self.lost_reports = 0
        self.replaced: list[DriveEvent] = []
        self._children: dict[Role, _Child] = {}
        self._wish_number, self._wish_at_s = 0, time.monotonic()
        self._stopping = False
        self._doubtful: dict[str, float] = {}
        self._taken_over = False
        self._handed_s = 0.0

    def __enter__(self) -> Self:
        try:
            self._tell(DriveEvent("begun", value=self._settings))
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

    def ask(self, text: str, person: str = NOBODY, *, confirmed: str = "") -> str:
        """Hand a wish to the planner; returns its id. What becomes of it is told by events.

        A stop at once is no planner's to decide: the car is brought to a stand, whoever asks.

        Args:
            text: The words.
            person: Whose they are.
            confirmed: The car's question to which they are the yes.
        """
        wish = self.next_wish
        request = Request(wish, text, person, confirmed=confirmed, runs=bool(self.open_wishes), doing=self._doing())
        interaction = self.interactions[wish] = Interaction(request, since_s=time.monotonic())
        if stop_wanted(read_emergency(text)):
            self.halt()
            self._close(interaction, DriveEvent("interrupted", wish, STOPPING))
        else:
            self._send(interaction)
        return wish

    def _doing(self) -> str:
        """What is driven, or what became of what was driven last, by the plan's acts and the state of its execution."""
        driven = [one for one in self.interactions.values() if one.started_tick is not None and one.brief is not None]
        if not driven or (brief := driven[-1].brief) is None:
            return ""
        answer = driven[-1].answer
        became = "I am at it." if answer is None else "That is done." if answer.kind == "finished" else answer.text
        acts = wish_words(brief.plan.acts)
        return f"You asked: “{driven[-1].request.text}” {f'I took that for: “{acts}” ' if acts else ''}{became}"

    @property
    def next_wish(self) -> str:
        """Id that the next wish will get."""
        return f"w{len(self.interactions) + 1}"

    def take_over(self, on: bool) -> None:
        """The person takes the wheel, or gives it back.

        The plan that is driven ends with it, and so does every wish that has no plan yet. While the person has the
        wheel, `hand` moves the car; when they give it back, the car holds speed and lane until a new wish is driven.
        """
        if on == self._taken_over or not self._rings:
            return
        self._taken_over = on
        self._say_who_drives()
        if on:
            for interaction in self.open_wishes:
                if interaction.stage != "driven":  # of what is driven, the policy tells
                    self._close(interaction, DriveEvent("interrupted", interaction.request.wish, TOOK_OVER))

    def _say_who_drives(self) -> None:
        self._rings["hand"].write(WheelHand(self._taken_over).encode())
        self._handed_s = time.monotonic()

    @property
    def taken_over(self) -> bool:
        """Whether the person has the wheel, as told by `take_over`; `report.taken_over` says what control knows."""
        return self._taken_over

    def hand(self, key: Key) -> None:
        """A key of the person at the wheel, pressed once; nothing while they do not have it.

        `faster` and `slower` move the speed that is kept by 5 km/h (2.5 km/h in a lot), `left` and `right` mean one
        lane, or a turn where a crossing is ahead, `brake` brakes to a stand. Limits and shield stay.
        """
        if self._taken_over and self._rings:
            self._rings["hand"].write(WheelHand(True, key).encode())

    def poll(self) -> None:
        """Hear what came, see who lives."""
        for each in self._rings.values():
            each.renew()
        self._hear()
        now_s = time.monotonic()
        self._look_after_children(now_s)
        self._look_after_wishes(now_s)
        self._look_after_wheel(now_s)

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

    def halt(self) -> None:
        """Have the car brought to a stand, without waiting for it: poll until it is no longer `driving`."""
        control = self._children["control"].process
        if control.poll() is None:
            control.terminate()

    def abort(self) -> None:
        """End every process at once, wherever the car is."""
        self._stopping = True
        for child in self._children.values():
            if child.process.poll() is None:
                child.process.kill()
                child.process.wait()

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
        if self._rings:
            self._hear()
        for interaction in self.open_wishes:
            self._close(interaction, DriveEvent("interrupted", interaction.request.wish, "The drive is over."))

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
        self._start("spare")
        self._wish_at_s = time.monotonic()

    def _ready_file(self, role: Role) -> Path:
        return self.folder / f"{role}{READY_SUFFIX}"

    def _start(self, role: Role) -> None:
        self._ready_file(role).unlink(missing_ok=True)
        with (self.folder / f"{role}.log").open("ab") as log:
            process = subprocess.Popen(  # noqa: S603 - this package's own processes
                [sys.executable, "-m", "chauffeur.driving.live", role, str(self.folder), str(os.getpid())],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,  # a share of the cores of its own; and Ctrl-C is this process's to hear
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
        head = self._rings["setpoints"].head
        if head != self._wish_number or not self._ready_file("policy").exists():
            self._wish_number, self._wish_at_s = head, now_s
        elif now_s - self._wish_at_s > SILENT_S and policy.process.poll() is None and policy.restart_at_s is None:
            self._replace_hung(policy, now_s)
        helpers: tuple[Role, ...] = ("policy", "planner", "spare")
        for role in helpers:
            child = self._children[role]
            if child.restart_at_s is not None:
                if now_s >= child.restart_at_s and not (role == "policy" and self._spare_takes_over(now_s)):
                    self._start(role)
            elif (code := child.process.poll()) is not None:
                self._replace(child, f"It ended with code {code}.", now_s)

    def _spare_takes_over(self, now_s: float) -> bool:
        """Call the policy process that waits; False if none is ready."""
        spare = self._children["spare"]
        if spare.restart_at_s is not None or not self._ready_file("spare").exists() or spare.process.poll() is not None:
            return False
        spare.process.send_signal(signal.SIGUSR1)
        starts = self._children["policy"].starts + 1
        self._children["policy"] = _Child("policy", spare.process, now_s, starts)
        self._ready_file("policy").touch()
        self._ready_file("spare").unlink(missing_ok=True)
        spare.restart_at_s = now_s + SPARE_PAUSE_S
        return True

    def _replace_hung(self, child: _Child, now_s: float) -> None:
        child.process.kill()
        child.process.wait()
        self._replace(child, "It hung.", now_s)

    def _replace(self, child: _Child, why: str, now_s: float) -> None:
        """Start anew: at once if it lived a while, later and later if it dies again and again."""
        again = now_s - child.started_s <= LONGEST_PAUSE_S
        pause_s = min(LONGEST_PAUSE_S, FIRST_PAUSE_S * 2.0 ** min(child.starts, 8)) if again else 0.0
        child.restart_at_s = now_s + pause_s
        if child.role == "spare":
            return
        said = DriveEvent("replaced", text=why, value=child.role)
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
            int(other.request.wish[1:]) > int(request.wish[1:]) for other in self.open_wishes if not other.request.aside
        )
        if newer:
            self._close(interaction, DriveEvent("superseded", request.wish, "A newer wish came."))
        elif request.turn >= MOST_TURNS or self._stopping or not self.driving:
            self._close(interaction, DriveEvent(kind, request.wish, why))
        else:
            interaction.request = replace(request, turn=request.turn + 1)
            self._send(interaction)

    def _look_after_wishes(self, now_s: float) -> None:
        for interaction in self.open_wishes:
            waited_s = now_s - interaction.since_s
            if not self.driving:
                self._close(interaction, DriveEvent("interrupted", interaction.request.wish, "The drive is over."))
            elif interaction.stage == "asked" and waited_s > self._patience_s(interaction):
                planner = self._children["planner"]
                if planner.restart_at_s is None and self._ready_file("planner").exists():
                    if interaction.request.turn > 1 and interaction.since_s > planner.started_s:  # asked anew in vain
                        self._replace_hung(planner, now_s)
                    else:
                        self._again(interaction, "unplanned", "The planner does not answer.")
            elif interaction.stage == "planned" and waited_s > UNSTARTED_S:
                self._again(interaction, "failed", "The plan was lost on its way to the policy.")
            elif interaction.stage == "driven":
                self._settle_doubt(interaction)

    def _look_after_wheel(self, now_s: float) -> None:
        """Say once more who has the wheel, where control goes by something else: what was said may have been lost."""
        known = self.report is not None and self.report.taken_over
        if known != self._taken_over and now_s - self._handed_s > UNHANDED_S:
            self._say_who_drives()

    @staticmethod
    def _patience_s(interaction: Interaction) -> float:
        """How long a planner may be silent: it takes a wish up at once, and may then think."""
        taken_up = sum(event.kind == "planning" for event in interaction.events) >= interaction.request.turn
        return PLANNER_SILENT_S if taken_up else UNHEARD_S

    def _settle_doubt(self, interaction: Interaction) -> None:
        """After the policy was replaced: either it goes on with the wish, or the wish ended with it."""
        wish = interaction.request.wish
        since_s = self._doubtful.get(wish)
        policy = self._children["policy"]
        if since_s is None or policy.restart_at_s is not None or policy.started_s < since_s:
            return
        message = self._rings["setpoints"].latest()
        if message is None or message.written_ns * 1e-9 < policy.started_s:
            return
        try:
            goes_on = LiveSetpoints.decode(message.payload).plan == wish
        except MessageError:
            return
        del self._doubtful[wish]
        if not goes_on:
            self._close(interaction, DriveEvent("interrupted", wish, "The process that drove it died."))

    def _close(self, interaction: Interaction, answer: DriveEvent) -> None:
        plan = None if interaction.brief is None else interaction.brief.plan
        result = result_of_event(answer.kind, interaction.request.text, plan)
        interaction.stage, interaction.answer = "closed", replace(answer, final=True, result=result)
        interaction.events.append(interaction.answer)
        self._tell(interaction.answer)

    # Hearing ----------------------------------------------------------------------------------------------------------

    def _hear(self) -> None:
        self._hear_reports()
        # Events first, for a brief is left before its plan is told of: but what it says is known before they are taken.
        told: tuple[tuple[Role, tuple[RingMessage, ...]], ...] = (
            ("planner", self._heard["planner_events"].news()[0]),
            ("policy", self._heard["policy_events"].news()[0]),
        )
        self._hear_briefs()
        for role, messages in told:
            self._hear_events(role, messages)

    def _hear_briefs(self) -> None:
        messages, lost = self._heard["briefs"].news()
        briefs: list[PlanningInputs] = []
        for message in messages:
            try:
                briefs.append(read_brief(message.payload))
            except MessageError:
                lost += 1
        if lost:
            self._tell(DriveEvent("lost", text="what plans were made of was not heard in time", value=lost))
        for brief in briefs:
            if brief.wish in self.interactions:
                self.interactions[brief.wish].brief = brief
            context = DriveEvent("context", brief.wish, trip=brief.trip, tick=brief.tick, value=brief.context)
            self._tell(context)
            self._tell(replace(context, kind="history", value=brief.history))
            self._tell(replace(context, kind="plan", value=brief.plan))

    def _hear_reports(self) -> None:
        messages, lost = self._heard["reports"].news()
        self.lost_reports += lost
        for message in messages:
            self.report = report = Report.decode(message.payload)
            self._tell(DriveEvent("period", report.plan, trip=report.trip, tick=report.tick, value=report))
            for text in report.said:
                self._take(DriveEvent("said", report.plan, text, report.trip, report.tick), "control")

    def _hear_events(self, sent_by: Role, messages: tuple[RingMessage, ...]) -> None:
        for message in messages:
            try:
                event = read_event(message.payload)
            except MessageError:
                continue
            self._take(event, sent_by)

    def _take(self, event: DriveEvent, sent_by: Role) -> None:
        interaction = self.interactions.get(event.wish)
        if interaction is None or (interaction.stage == "closed" and event.kind != "verdicts"):
            if interaction is None:
                self._tell(event)
            return
        if event.kind == "verdicts":
            interaction.events.append(event)
            self._tell(event)
        elif event.kind == "stale" or (event.kind == "unplanned" and sent_by == "planner"):
            if not event.again:
                self._close(interaction, event)
                return
            interaction.events.append(event)
            self._tell(event)
            self._again(interaction, event.kind, event.text)
        elif event.kind in FINAL:
            self._close(interaction, event)
        elif event.kind == "halt" and sent_by == "planner":
            self.halt()
            self._tell(event)
            self._close(interaction, replace(event, kind="interrupted"))
        else:
            stages: dict[EventKind, Stage] = {"planned": "planned", "started": "driven", "resumed": "driven"}
            stage = stages.get(event.kind, interaction.stage)
            if not (event.kind == "planned" and interaction.stage == "driven"):  # told by two processes, in any order
                interaction.stage = stage
            interaction.since_s = time.monotonic()
            interaction.events.append(event)
            self._tell(event)


def _new_folder() -> Path:
    """A folder for shared memory, in memory where there is any; what killed supervisors left there is removed."""
    memory = Path("/dev/shm")  # noqa: S108 - a new folder in it, of this user alone
    place = memory if os.access(memory, os.W_OK) else Path(tempfile.gettempdir())
    for left in place.glob(f"{FOLDER_PREFIX}*"):
        with contextlib.suppress(OSError, ValueError):  # not of this user, or just being made or removed
            owner = int((left / OWNER_FILE).read_text())
            idle_s = time.time() - max(file.stat().st_mtime for file in left.iterdir())
            if not Path(f"/proc/{owner}").exists() and idle_s > LEFT_FOR_S:
                _end_what_serves(left)
                shutil.rmtree(left)
    folder = Path(tempfile.mkdtemp(prefix=FOLDER_PREFIX, dir=place))
    (folder / OWNER_FILE).write_text(str(os.getpid()))
    return folder


def _end_what_serves(folder: Path) -> None:
    """End processes of a drive whose supervisor is long dead: one that was stopped then cannot end itself.

    All but control, which alone may say when a car is not driven any more.
    """
    for command in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):  # gone meanwhile, or not of this user
            words = command.read_bytes().split(b"\0")
            if os.fsencode(folder) in words and _MODULE in words and b"control" not in words:
                os.kill(int(command.parent.name), signal.SIGKILL)


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
