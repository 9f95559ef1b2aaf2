"""A drive in real time on the terminal: the conversation, below it how the car stands, in the end what came of it."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from types import TracebackType
from typing import Any, Final, Self

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from chauffeur.cli.console import columns, plain
from chauffeur.cli.labels import EVENTS, RUNGS
from chauffeur.concept import Intervention, LaneId, Scenario
from chauffeur.drive.live.messages import Report, Rung
from chauffeur.drive.live.orders import Brief, Event
from chauffeur.drive.live.supervisor import Interaction, Replaced, Runtime
from chauffeur.hmi import words

REFRESH_S: Final = 0.1
"""Between two pictures of the status line."""
PLAIN_EVERY_S: Final = 5.0
"""Vehicle time between two status lines where they cannot be rewritten."""
_MOST_TYPED: Final = 2
"""Lines of the screen for what is being typed; its end is shown."""
_MOST_IN_SUMMARY: Final = 200
"""Characters of a wish that the summary repeats."""

_SCHEDULING: Final = {
    "fifo": "Real time (fifo): no ordinary program takes its core",
    "nice": "Favoured (nice): other programs get less of its core, but some",
    "default": "As any other program (default): no more was asked for, or allowed",
}

_OUTCOMES: Final = {
    "ended": ("Drive ended", "bold"),
    "stopped": ("Stopped", "bold"),
    "collision": ("Collision", "bold red"),
    "off_road": ("Left the road", "bold red"),
    "died": ("Control died, and in a vehicle its gateway would have to brake now;", "bold red"),
    "aborted": ("Broken off while driving", "bold red"),
}


class QuietScreen:
    """Says how it ended, and nothing else."""

    def __init__(self, console: Console, dt_s: float) -> None:
        """Set up.

        Args:
            console: Where to print.
            dt_s: Control period in vehicle time.
        """
        self.console, self.dt_s = console, dt_s
        self.runtime: Runtime | None = None
        self.changes: list[Intervention] = []
        self.clipped: Counter[str] = Counter()
        self.rungs: Counter[Rung] = Counter()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Nothing to put away."""

    def begin(self, scenario: Scenario, seed: int, planner: str) -> None:
        """Before anything happens."""

    def note(self, text: str, style: str = "bold yellow") -> None:
        """Something to be said beside the conversation."""

    def asked(self, wish: str, text: str) -> None:
        """A wish goes to the planner."""

    def tell(self, heard: Event | Report | Brief | Replaced) -> None:
        """What the drive tells."""
        if isinstance(heard, Report):
            self.changes += heard.interventions
            self.clipped.update(heard.clipped)
            self.rungs[heard.rung] += 1

    def refresh(self, typed: str | None, stopping: bool) -> None:
        """Show how the car stands, and what is being typed; None where nobody types."""

    def end(self, outcome: str, figures: Mapping[str, Any] | None, unasked: tuple[str, ...], trouble: str = "") -> None:
        """How it ended.

        Args:
            outcome: Of the trip, or what became of control.
            figures: Punctuality of control, if it could still tell.
            unasked: Wishes that it never came to.
            trouble: Last words of a process that died.
        """
        del figures, unasked, trouble
        label, style = _OUTCOMES.get(outcome, (outcome, "bold"))
        line = Text(label, style)
        report = None if self.runtime is None else self.runtime.report
        if report is not None:
            line.append(f" after {(report.tick + 1) * self.dt_s:.1f} s", style="not bold")
        self.console.print(line.append(" (simulated drive)", style="dim"))


class LiveScreen(QuietScreen):
    """Says everything, in the order in which it happens."""

    def __init__(self, console: Console, dt_s: float) -> None:
        super().__init__(console, dt_s)
        self._live = Live(console=console, transient=True, auto_refresh=False) if console.is_terminal else None
        self._drawn_s = 0.0
        self._plain_due_s = 0.0
        self._plain_rung: Rung = "follow"

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._still()

    def begin(self, scenario: Scenario, seed: int, planner: str) -> None:
        """Name the road, and what to do."""
        title = plain(scenario.title or scenario.id)
        facts = f" ({scenario.id}, seed {words.seed_words(seed)}, planner {planner}; simulated)"
        self.console.print(Text.assemble(title, plain(facts)), style="dim")

    def note(self, text: str, style: str = "bold yellow") -> None:
        """Print a note."""
        self.console.print(Text(style=style).append_text(plain(text)))

    def asked(self, wish: str, text: str) -> None:
        """Print a wish."""
        self._line(wish, "asked", "bold cyan", Text.assemble("“", plain(text), "”"))

    def tell(self, heard: Event | Report | Brief | Replaced) -> None:
        """Print what became of a wish; keep what control says for the status line."""
        super().tell(heard)
        match heard:
            case Event():
                self._event(heard)
            case Replaced():
                text = f"The {heard.role} process is replaced. {heard.why}"
                self._line("", "replaced", "bold yellow", plain(text))
            case Report():
                if self._live is None:
                    self._plain_status(heard)
            case Brief():
                pass  # what the plan says comes with the event that tells of it

    def refresh(self, typed: str | None, stopping: bool) -> None:
        """Draw the status line anew, ten times a second at most."""
        now_s = time.monotonic()
        if self._live is None or now_s - self._drawn_s < REFRESH_S:
            return
        self._drawn_s = now_s
        lines = list(self._status(stopping))
        if typed is not None:
            width = max(20, self.console.width * _MOST_TYPED - 4)
            lines.append(Text.assemble(("› ", "bold cyan"), plain(typed[-width:]), ("▏", "dim")))
        if not self._live.is_started:
            self._live.start()
        self._live.update(Group(*lines), refresh=True)

    def end(self, outcome: str, figures: Mapping[str, Any] | None, unasked: tuple[str, ...], trouble: str = "") -> None:
        """The outcome, every wish with its answer, and how control did."""
        self._still()
        self.console.print()
        super().end(outcome, figures, unasked)
        rows: list[tuple[str, Text]] = []
        if trouble:
            rows.append(("last words", plain(trouble)))
        interactions = () if self.runtime is None else tuple(self.runtime.interactions.values())
        rows += [(f"wish {each.request.wish[1:]}", _answered(each)) for each in interactions]
        rows += [("not asked", _quoted(text)) for text in unasked]
        rows += [(name, plain(said)) for name, said in self._figures(figures)]
        self.console.print(columns(rows))

    def _figures(self, figures: Mapping[str, Any] | None) -> Iterator[tuple[str, str]]:
        yield "shield", words.shield_words(self.changes) or "The shield changed no command."
        if self.clipped:
            count = ", ".join(f"{name} {times}" for name, times in self.clipped.most_common())
            yield "limits", f"Wishes held within the limits, in control periods: {count}."
        lower = [f"{RUNGS[rung]}: {_periods(count)}" for rung, count in self.rungs.items() if rung != "follow"]
        if lower:
            yield "ladder", "; ".join(lower) + "."
        if figures is not None:
            period_ms = 1000.0 * figures["period_s"]
            due = figures["ticks"] + figures["missed"]
            yield "control", f"{figures['missed']} of {_periods(due)} of {period_ms:g} ms were missed."
            late = ("p50", "p99", "p999", "max")
            shares = ("50 %", "99 %", "99.9 %", "all")
            told = (f"{figures[f'{at}_ms']:.2f} ms ({share})" for at, share in zip(late, shares, strict=True))
            yield "punctuality", f"Periods began late by at most {', '.join(told)}."
            memory = "" if figures["memory_locked"] else "; memory not locked"
            yield "scheduling", f"{_SCHEDULING[figures['scheduling']]}{memory}."
        else:
            yield "control", "It left no figures of its punctuality."
        report, runtime = (None, None) if self.runtime is None else (self.runtime.report, self.runtime)
        if report is not None and report.refused:
            count = ", ".join(f"{why} {times}" for why, times in report.refused.items())
            yield "disbelieved", f"Messages of the policy that control did not believe: {count}."
        if report is not None and report.faults:
            yield "faults", f"{_periods(report.faults)} of control failed and were answered by braking."
        if runtime is not None:
            yield "reports", f"{runtime.lost_reports or 'none'} lost."

    # The conversation -------------------------------------------------------------------------------------------------

    def _event(self, event: Event) -> None:
        interaction = None if self.runtime is None else self.runtime.interactions.get(event.wish)
        turn = 1 if interaction is None else interaction.request.turn
        if event.kind == "planning":
            if turn > 1:
                self._line(event.wish, "asked", "cyan", Text(f"once more ({turn - 1})", "dim"))
            return
        label, style = EVENTS[event.kind]
        text = plain(event.text)
        match event.kind:
            case "started":
                text = Text("All checks passed.", "dim")
            case "said":
                text = Text.assemble("“", text, "”")
            case "finished":
                text = text or Text("The program has ended; what it wished stays.", "dim")
            case "stale" | "unplanned" if interaction is not None and interaction.answer is event:
                if len(interaction.events) > 1 and interaction.events[-2].text == event.text:
                    text = Text(f"Given up on, asked {turn} times." if turn > 1 else "Given up on.", "dim")
            case _:
                pass
        self._line(event.wish, label, style, text)

    def _line(self, wish: str, label: str, style: str, body: Text) -> None:
        report = None if self.runtime is None else self.runtime.report
        at_s = 0.0 if report is None else report.tick * self.dt_s
        name = Text.assemble((f"{at_s:6.1f} s  {wish:<3} ", "dim"), (f"{label:<10}", f"{style} not dim"))
        self.console.print(columns([(name, body)], indent=0))

    # The status line --------------------------------------------------------------------------------------------------

    def _status(self, stopping: bool) -> Iterator[Text]:
        report = None if self.runtime is None else self.runtime.report
        if report is None or self.runtime is None:
            yield Text("starting control, policy and planner ...", "dim")
            return
        yield _line_of(report, self.dt_s, stopping)
        facts = [
            _age_of(report),
            Text(f"missed {report.missed} of {report.tick + 1 + report.missed}", "" if not report.missed else "red"),
            Text(f"scheduling: {scheduling_of(self.runtime.pid('control'))}"),
        ]
        if self.changes:
            facts.append(Text(words.shield_words(self.changes).rstrip(".")))
        if report.faults:
            facts.append(Text(f"{_periods(report.faults)} failed", "red"))
        waiting = [each.request.wish for each in self.runtime.open_wishes if each.stage == "asked"]
        if waiting:
            facts.append(Text(f"planning {', '.join(waiting)}", "cyan"))
        yield Text("   ", "dim").join(facts)

    def _plain_status(self, report: Report) -> None:
        at_s = report.tick * self.dt_s
        let_go = {"keep", "slow", "stop", "hand"}
        stepped = report.rung != self._plain_rung and bool({report.rung, self._plain_rung} & let_go)
        self._plain_rung = report.rung
        if stepped or at_s >= self._plain_due_s:
            self._plain_due_s = at_s + PLAIN_EVERY_S
            line = _line_of(report, self.dt_s, stopping=False)
            self.console.print(Text("   ").join((line, _age_of(report))))

    def _still(self) -> None:
        if self._live is not None and self._live.is_started:
            self._live.stop()


def scheduling_of(process: int) -> str:
    """How the machine schedules a process: `fifo`, `nice` or `default`; empty once it is gone."""
    try:
        if os.sched_getscheduler(process) == os.SCHED_FIFO:
            return "fifo"
        return "nice" if os.getpriority(os.PRIO_PROCESS, process) < 0 else "default"
    except (OSError, AttributeError):
        return ""


def last_words(runtime: Runtime) -> str:
    """The last line control has left in its log."""
    try:
        lines = (runtime.folder / "control.log").read_text(errors="replace").strip().splitlines()
    except OSError:
        return ""
    return lines[-1] if lines else ""


def _line_of(report: Report, dt_s: float, stopping: bool) -> Text:
    parts = [Text(f"{report.tick * dt_s:6.1f} s"), Text(f"{words.speed(report.speed_mps):>20}", "bold")]
    parts.append(Text(_lane(report.lane)))
    if stopping:
        parts.append(Text("coming to a stand", "bold yellow"))
    elif report.rung != "follow":
        parts.append(Text(RUNGS[report.rung], "bold yellow"))
    if report.plan:
        line = "" if report.line is None or report.state != "running" else f", line {report.line}"
        parts.append(Text(f"{report.plan} {report.state}{line}"))
    else:
        parts.append(Text("no plan"))
    return Text("   ").join(parts)


def _age_of(report: Report) -> Text:
    return Text(f"wish {report.age_s:.2f} s old", "" if report.rung == "follow" else "yellow")


def _lane(lane: LaneId | None) -> str:
    return "in no lane" if lane is None else f"lane {lane[2] + 1} from left"


def _answered(interaction: Interaction) -> Text:
    """A wish and its answer, in a line or two."""
    wish = _quoted(interaction.request.text).append(" ")
    answer = interaction.answer
    if answer is None:
        return wish.append("no answer", "bold red")
    label, style = EVENTS[answer.kind]
    driven = any(event.kind == "started" for event in interaction.events)
    why = answer.text
    if answer.kind == "interrupted":
        label = "was being driven" if driven else "not driven"
    if answer.kind == "finished":
        why = ""
    return wish.append(label, style).append_text(Text(": ") + plain(why) if why else Text())


def _quoted(text: str) -> Text:
    short = text if len(text) <= _MOST_IN_SUMMARY else text[:_MOST_IN_SUMMARY] + " ..."
    return Text.assemble("“", plain(short), "”")


def _periods(count: int) -> str:
    return f"{count} period{'' if count == 1 else 's'}"
