"""What is told of a drive: one kind of event, whoever drives and whoever listens.

A drive in simulated time, one in real time over several processes and a session on a real vehicle tell `DriveEvent`s;
terminal, pages, audit log and memory subscribe. A listener reads what it knows and passes the rest over; it must not
block. What a screen is sent (`talk/messages.py`) is made of these.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

if TYPE_CHECKING:
    from chauffeur.concept import (
        CameraImage,
        Context,
        Frame,
        History,
        Instruction,
        Parameters,
        Plan,
        Result,
        SystemMessage,
        Trip,
        Verdict,
    )
    from chauffeur.driving.live.messages import LiveEnd, Report
    from chauffeur.driving.live.settings import Settings
    from chauffeur.driving.onroad.answers import OnRoadAnswer, Opinion, SetpointRequest, SetpointResult
    from chauffeur.worlds.ros.base import Published, RosVehicleState

    EventValue: TypeAlias = (
        Instruction | Context | History | SystemMessage | tuple[CameraImage, ...] | Plan | tuple[Verdict, ...]
        | Frame | Report | Trip | RosVehicleState | SetpointRequest | Published | SetpointResult | OnRoadAnswer
        | Opinion | Parameters | Settings | LiveEnd | int | str
    )  # fmt: skip

Letter = Literal["wish", "context", "history", "system", "view", "plan", "verdicts"]
"""I, C, H, S, V of the paper's pictures, (R, P) and V: the way from words to a checked plan, in this order."""

WishEventKind = Literal[
    "planning", "planned", "declined", "unplanned", "superseded", "started", "refused", "stale", "finished", "failed",
    "interrupted", "resumed", "said", "garbage", "answered", "halt", "waits", "unasked",
]  # fmt: skip
"""What becomes of a wish in real time, in about this order. `declined`: the planner says no, in words; `unplanned`: it
could not; `refused`: a check says no; `stale`: the plan came too late; `interrupted`: the process that ran it is gone,
or the person has taken over; `answered`: it was a question, and what was driven is driven on; `halt`: the planner
understood a call to stop, and the car is brought to a stand; `waits`: the wish is pending, until its time or event;
`unasked`: it never came to be asked."""

VehicleEventKind = Literal["link", "asking", "asked", "applied", "late", "answer", "feedback"]
"""Of a real vehicle. `link`: the way to it changed; `asking`: it is about to be asked, `asked`: messages are handed to
the interface, `applied`: what came of that; `late`: what was unconfirmed was taken after all; `answer`: what became of
a wish; `feedback`: an opinion on the drive."""

EventKind = Literal[
    Letter, WishEventKind, VehicleEventKind, "begun", "period", "trip", "replaced", "lost", "trouble", "over",
]  # fmt: skip
"""`begun`: processes are started; `period`: a control period; `trip`: how it ended, scored; `replaced`: a process of
the drive was; `lost`: messages of one were not heard in time; `trouble`: something besides the wish failed (memory,
audit log); `over`: the session ended."""

FINAL: Final[frozenset[WishEventKind]] = frozenset(
    {"declined", "unplanned", "superseded", "refused", "stale", "finished", "failed", "interrupted", "answered"}
)
"""Events after which nothing more becomes of a wish, unless it is asked again."""


@dataclass(frozen=True, slots=True)
class DriveEvent:
    """Something that happened on a drive.

    Attributes:
        kind: What.
        wish: Id of the wish it belongs to; empty where it belongs to none, or where there is only one.
        text: In words, for the person; often empty.
        trip, tick: When, of drives that count trips.
        again: Of a wish without a plan: whether asking once more may help.
        offer: Where the text is a question: the wish that a yes stands for, empty for none.
        final: Whether nothing more becomes of the wish.
        result: What became of it then, in the one vocabulary of results.
        value: A letter's value; `Frame` or `Report` (period); `Trip`; `Settings` (begun); name of the process
            (replaced); how many (lost); `VehicleState` (link, late), `SetpointRequest` (asking), `Published` (asked),
            `SetpointResult` (applied), `OnRoadAnswer` (answer), `Opinion` (feedback); what stays in force of a
            vehicle's `Parameters`, or `LiveEnd` (over).
    """

    kind: EventKind
    wish: str = ""
    text: str = ""
    trip: int = 0
    tick: int = 0
    again: bool = True
    offer: str = ""
    final: bool = False
    result: Result | None = None
    value: EventValue | None = None


Listener = Callable[[DriveEvent], None]


def nobody_listens(event: DriveEvent) -> None:
    """The listener of a drive that nobody follows."""
    del event


def told_to(*listeners: Listener) -> Listener:
    """One listener that hands everything on to several, in this order."""

    def tell(event: DriveEvent) -> None:
        for listener in listeners:
            listener(event)

    return tell
