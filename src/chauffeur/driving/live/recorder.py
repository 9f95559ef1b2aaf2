"""The session record of a drive in real time: every wish, what became of it, and what control did, in the audit log.

A wish is on the disk before it goes to the planner (`kept`); all else is handed over as it is heard, and neither waits
nor raises. A session that was killed leaves its open wishes behind; `unanswered` finds them.

Besides the records of any drive (`driving/session_recorder.py`), each with the id of its wish: `verdict` of `live`,
whether a plan was started; `outcome`, what became of a wish, and of the drive; `context`, with a `letter`, C and H of
a plan, and, with an `event`, what happened in between: one of the events of a wish, `replaced`, `level`, `taken_over`
or `settings`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from chauffeur.concept import Instruction
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.live.messages import FallbackLevel, Report
from chauffeur.driving.live.settings import Settings
from chauffeur.driving.live.supervisor import Runtime
from chauffeur.driving.session_recorder import FLUSH_TIMEOUT_S, DriveRecorder
from chauffeur.safety.audit.reader import read_records
from chauffeur.safety.audit.redaction import PERSON
from chauffeur.safety.audit.texts import words_of
from chauffeur.safety.audit.writer import Closing

JUDGED: Final = "live"
"""Name of the judgement over all checks, made when a plan is about to start: the policy tells no more of it."""

_DRIVEN: Final[frozenset[FallbackLevel]] = frozenset({"follow", "hold"})
"""Between these the level goes up and down without anything being let go of."""


@dataclass(frozen=True, slots=True)
class Unanswered:
    """A wish of a session that ended before it was answered.

    Attributes:
        wish: Its id there.
        text: The words, or in brackets why they are not kept.
        person: Who said it.
    """

    wish: str
    text: str
    person: str


def unanswered(path: Path) -> tuple[Unanswered, ...]:
    """Wishes of the last session in a log to which nothing was answered, oldest first; none where there is no log.

    Raises:
        DataError: The log cannot be read.
    """
    waiting: dict[str, Unanswered] = {}
    if not path.is_file():
        return ()
    for _, record in read_records(path):
        wish = str(record.body.get("wish", ""))
        match record.kind:
            case "opened":
                waiting.clear()
            case "wish":
                words = words_of(record)
                waiting[wish] = Unanswered(wish, words.get("wish", ""), words.get(PERSON, ""))
            case "outcome":
                waiting.pop(wish, None)
            case _:
                pass
    return tuple(waiting.values())


class LiveRecorder:
    """Writes one drive in real time into a log; used from the thread that polls the drive."""

    def __init__(self, auditor: DriveRecorder, dt_s: float) -> None:
        """Keep books.

        Args:
            auditor: Writes the log.
            dt_s: Control period in vehicle time.
        """
        self._auditor, self._log, self._dt_s = auditor, auditor.log, dt_s
        self._disk = ThreadPoolExecutor(1, "audit flush")
        self._runtime: Runtime | None = None
        self._lost_briefs = 0
        self._level: FallbackLevel = "follow"
        self._levels: Counter[FallbackLevel] = Counter()
        self._taken_over = False
        self._takeovers = 0
        self._tick = -1
        self._outcome_written = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None:
            self._over("broken_off", {"error": type(error).__name__})
        self.close()

    def follow(self, runtime: Runtime, settings: Settings) -> None:
        """A drive has begun; what is told from now on is its.

        Args:
            runtime: Processes of the drive.
            settings: What they were told.
        """
        self._runtime = runtime
        about = {name: value for name, value in asdict(settings).items() if name not in ("starts", "base_url")}
        starts = [{"limits": asdict(start.limits), "most_s": start.most_s} for start in settings.starts]
        self._note("settings", {**about, "starts": starts})

    def wish(self, wish: str, instruction: Instruction) -> None:
        """Write a wish down; it is handed to the planner when `kept` says so.

        Args:
            wish: Id it will have; empty for one that will not be asked.
            instruction: The words, and whose they are.
        """
        self.tell(DriveEvent("wish", wish, instruction.text, value=instruction))

    def kept(self) -> Future[bool]:
        """Whether all of this is on the disk, as soon as that is known: at most `FLUSH_TIMEOUT_S` later."""
        return self._disk.submit(self._log.flush, FLUSH_TIMEOUT_S)

    def answer(self, wish: str, kind: str, why: str) -> None:
        """What became of a wish that the drive itself never heard of."""
        self._auditor.personal("outcome", wish, {"wish": wish, "outcome": kind}, {"detail": why})

    def tell(self, event: DriveEvent) -> None:
        """Hear what the drive tells."""
        match event.value:
            case Report() as report:
                self._auditor.guarded("actuation", lambda: self._report(report))
            case None:
                self._auditor.guarded("outcome", lambda: self._became(event))
            case str() as process:
                self._note("replaced", {"process": process, "why": event.text})
            case _:
                self._auditor.guarded("plan", lambda: self._letter(event))

    def end(self, outcome: str, figures: Mapping[str, Any] | None, lost_reports: int) -> None:
        """How the drive ended.

        Args:
            outcome: Of the trip, as control reported it; or what became of control.
            figures: Its punctuality, if it could still tell.
            lost_reports: Control periods nobody heard of.
        """
        self._over(outcome, {"control": dict(figures or {}), "lost_reports": lost_reports})

    def close(self) -> Closing:
        """Write what is left, close the log, and say how it ended; a second call says the same."""
        self._disk.shutdown()
        return self._auditor.close()

    def _report(self, report: Report) -> None:
        if self._tick >= 0 and report.tick > self._tick + 1:
            self._log.append(
                "gap", {"lost": {"period": report.tick - self._tick - 1}, "why": "reports of control were not heard"}
            )
        self._tick = report.tick
        self._levels[report.level] += 1
        at_s = report.tick * self._dt_s
        self._auditor.period(
            report.tick, at_s, report.speed_mps, report.setpoints, report.requested, report.applied, report.state,
            report.interventions,
        )  # fmt: skip
        if report.taken_over != self._taken_over:
            self._taken_over = report.taken_over
            self._takeovers += report.taken_over
            self._note("taken_over", {"on": report.taken_over, "tick": report.tick, "speed_mps": report.speed_mps})
        before, self._level = self._level, report.level
        if before != report.level and not {before, report.level} <= _DRIVEN:
            self._note(
                "level", {"wish": report.plan, "level": report.level, "age_s": report.age_s, "tick": report.tick}
            )

    def _became(self, event: DriveEvent) -> None:
        at = {"wish": event.wish, "tick": self._tick}
        match event.kind:
            case "planned" | "declined" | "answered":
                pass  # the plan itself has been written down, with its refusal
            case "started":
                self._verdict(event, "")
            case "refused":
                self._verdict(event, event.text)
            case "stale" if not event.final:  # told once as it comes, and once more if it is the last word
                self._verdict(event, event.text)
            case _ if not event.final:
                self._auditor.personal("context", event.wish, {"event": event.kind, **at}, {"text": event.text})
            case _:
                pass
        if event.final:
            self._auditor.personal("outcome", event.wish, {**at, "outcome": event.kind}, {"detail": event.text})

    def _verdict(self, event: DriveEvent, why: str) -> None:
        body = {"wish": event.wish, "check": JUDGED, "passed": not why, "line": None, "tick": self._tick}
        self._auditor.personal("verdict", event.wish, body, {"reason": why})

    def _letter(self, event: DriveEvent) -> None:
        """Write down I, and C, H, R and P: they are told before anything becomes of the plan."""
        if self._runtime is not None and self._runtime.lost_briefs > self._lost_briefs:
            lost, self._lost_briefs = self._runtime.lost_briefs - self._lost_briefs, self._runtime.lost_briefs
            self._log.append("gap", {"lost": {"plan": lost}, "why": "what plans were made of was not heard in time"})
        about = {"wish": event.wish} if event.kind == "wish" else {"wish": event.wish, "tick": event.tick}
        self._auditor.letter(event, about)

    def _over(self, outcome: str, body: Mapping[str, Any]) -> None:
        if not self._outcome_written:
            self._outcome_written = True
            self._auditor.guarded("actuation", self._auditor.hand_over)
            self._log.append(
                "outcome",
                {
                    "outcome": outcome,
                    "duration_s": round((self._tick + 1) * self._dt_s, 6),
                    "periods_by_rung": dict(self._levels),
                    "takeovers": self._takeovers,
                    **body,
                },
            )

    def _note(self, event: str, body: Mapping[str, Any]) -> None:
        self._log.append("context", {"event": event, **body})
