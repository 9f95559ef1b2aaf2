"""A drive on the terminal: a live line while it moves, then what came of it and why; or everything, as it comes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from rich.color import Color
from rich.columns import Columns
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.padding import Padding
from rich.progress_bar import ProgressBar
from rich.style import Style
from rich.syntax import Syntax
from rich.text import Text

from chauffeur.cli.console import columns, path_text, plain
from chauffeur.concept import (
    ANSWERED,
    ASKS,
    CameraImage,
    Context,
    Frame,
    History,
    Instruction,
    Plan,
    Program,
    Scenario,
    Thoughts,
    Trip,
    Verdict,
)
from chauffeur.concept.units import SpeedUnit, people_speed
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.recording import RecordedTrip
from chauffeur.hmi import words
from chauffeur.hmi.payload import policy_words
from chauffeur.memory.conflicts import conflicts_in
from chauffeur.safety.faithfulness import mismatch_words, score_words

_CODE: dict[str, Any] = {
    "lexer": "python",
    "theme": "ansi_dark",
    "background_color": "default",
    "word_wrap": True,
}
_STYLES = {"good": "bold green", "bad": "bold red", "neutral": "bold"}


class Quiet:
    """Says how it ended, and nothing else."""

    def __init__(self, console: Console) -> None:
        self.console = console

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Nothing to put away."""

    def begin(self, scenario: Scenario, seed: int) -> None:
        """Before anything happens."""

    def compiling(self, done: int, of: int) -> None:
        """How far the simulator is compiled."""

    def tell(self, event: DriveEvent) -> None:
        """Hear what the drive tells."""
        if event.kind == "trouble":  # said even where little is
            self.console.print(plain(event.text), style="bold yellow")

    def writing(self, text: str, attempt: int) -> None:
        """A piece of a model's reply as it is written."""

    def end(self, recorded: RecordedTrip) -> None:
        """What came of it."""
        trip = recorded.trip
        sign, label, tone = words.trip_words(trip, timed=True)
        line = Text(f"{sign} {label}", _STYLES[tone])
        self.console.print(line.append(" (simulated drive)", style="dim not bold"))
        if not recorded.frames:
            self._why(trip.causes.detail)

    def _why(self, detail: str) -> None:
        self.console.print(plain(detail))

    def wrote(self, paths: list[Path]) -> None:
        """Files of the trip."""


class Teller(Quiet):
    """Says first what came of it, then what was wished, thought, driven and checked, in the passenger's units."""

    def __init__(self, console: Console) -> None:
        super().__init__(console)
        # A line that rewrites itself makes sense on a terminal only.
        self._live = Live(console=console, transient=True, refresh_per_second=10) if console.is_terminal else None
        self._waiting = False
        self._reply, self._attempt = "", 0
        self._unit: SpeedUnit = "km/h"
        self._source: tuple[str, ...] = ()
        self._compiles = False

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._still()

    def begin(self, scenario: Scenario, seed: int) -> None:
        """Before anything happens."""
        del seed
        self.stage(f"Setting up the road: {scenario.title or scenario.id}")

    def stage(self, name: str) -> None:
        """What is being done now, while there is nothing else to see."""
        self._live_line(Text.assemble(plain(name), " ..."), "dim")

    def compiling(self, done: int, of: int) -> None:
        """How far the simulator is compiled: said once where lines stay, shown as it goes where they do not."""
        said = "Compiling the simulator, once on this machine (about half a minute)"
        if self._live is not None:
            count = Text(f"  {done} of up to {of}", "dim")
            self._live_line(Group(Text(said), Columns([ProgressBar(total=of, completed=done, width=40), count])))
            self._live.refresh()
        elif not self._compiles:
            self.console.print(f"{said} ...", style="dim")
        self._compiles = True

    def tell(self, event: DriveEvent) -> None:
        """Go on to the next stage; show a frame on the live line. The letters are shown at the end."""
        match event.value:
            case Frame() as frame:
                self._frame(frame)
            case Instruction() as wish:
                self._unit = words.pace_of(wish.text)
            case History():
                self.stage("Reading the wish")
            case Plan(policy=policy):
                self._source = tuple(policy.text.splitlines()) if isinstance(policy, Program) else ()
                self.stage("Checking the plan")
            case _:
                super().tell(event)

    def writing(self, text: str, attempt: int) -> None:
        """Show the end of what the model has written so far; a new attempt begins anew."""
        self._reply = text if attempt != self._attempt else self._reply + text
        self._attempt = attempt
        latest = " ".join(self._reply[-400:].split())[-160:]
        self._live_line(Text.assemble(("planning ... ", "dim"), plain(latest)))

    def end(self, recorded: RecordedTrip) -> None:
        """What came of it; then the wish, the thoughts, the program, what was said and checked."""
        self._still()
        super().end(recorded)
        trip = recorded.trip
        shielded = words.shield_words([change for frame in recorded.frames for change in frame.interventions])
        account = f"You asked “{trip.instruction.text}”{words.account_words(trip)}"
        for told in (account, *self._why_not(trip), words.end_words(trip), shielded):
            if told:
                self.console.print(Padding(plain(told if told is account else self._units(told)), (0, 0, 0, 2)))
        self.console.print()
        self.console.print(columns(self._rows(recorded)))

    def _why_not(self, trip: Trip) -> tuple[str, ...]:
        """What went wrong; of a plan that was declined, what would do instead: the reason stands in the account."""
        if trip.outcome != "refused":
            return words.cause_words(trip.causes)
        return tuple(dict.fromkeys(one.remedy for one in trip.verdicts if one.stops and one.remedy))

    def _why(self, detail: str) -> None:
        """Told below, in the passenger's units."""

    def _rows(self, recorded: RecordedTrip) -> Iterator[tuple[str, RenderableType]]:
        trip = recorded.trip
        yield "Road", plain(recorded.scenario.title or recorded.scenario.id)
        if recorded.view is not None and self.console.is_terminal:
            yield "View", seat_view(recorded.view)
        if trip.history.items:
            yield "Memory", history_words(trip.history)
        if trip.plan.policy is None or trip.outcome == "refused":
            return
        yield "Thoughts", plain(self._units(trip.plan.thoughts.text.strip()) or "(no reasoning given)")
        if isinstance(trip.plan.policy, Program):  # gains and points are for engineers: --full
            yield "Program", self._program(trip.plan.policy)
        for at_s, text in trip.said:
            yield "Said", Text.assemble("“", plain(text), "”", (f"  after {at_s:.0f} s", "dim"))
        if trip.verdicts:
            yield "Checks", self._checks(trip.verdicts)

    def _program(self, program: Program) -> RenderableType:
        code = Syntax(plain(program.source.rstrip("\n")).plain, **_CODE)
        return Group(code, Text("its helper functions: --full", "dim")) if program.library else code

    def _checks(self, verdicts: tuple[Verdict, ...]) -> RenderableType:
        """Marks side by side, and below them what was not compared and what is not as it should be."""
        marks: list[Text] = []
        told: list[RenderableType] = []
        for verdict in verdicts:
            if verdict.mark in ("passed", "open"):
                rest = ", not all proven" if verdict.mark == "open" else ""
                mark = (words.MARKS[verdict.mark], words.MARK_STYLES[verdict.mark])
                marks.append(Text.assemble(mark, f" {words.check_name(verdict.check)}{rest}", no_wrap=True))
            elif verdict.mark != "not_compared":
                told.append(_told(verdict, self._units))
        if names := words.not_compared_names(verdicts):
            told.insert(0, Text(f"{words.MARKS['not_compared']} not compared: {names}", "dim"))
        return Group(Columns(marks, padding=(0, 3)), *told)

    def _units(self, text: str) -> str:
        return words.passenger_units(text, self._unit)

    def wrote(self, paths: list[Path]) -> None:
        """List the files."""
        names = {".mcap": "recording", ".html": "page", ".png": "filmstrip", "view.png": "view"}
        self.console.print(columns((names.get(p.name, names.get(p.suffix, "file")), path_text(p)) for p in paths))

    def _frame(self, frame: Frame) -> None:
        if self._live is None:
            return
        shot = frame.observation
        parts = [f"{shot.time_s:5.1f} s", f"{people_speed(shot.ego.speed_mps, self._unit):>8}"]
        if shot.front is not None:
            parts.append(f"gap {shot.front.distance_m:3.0f} m")
        if shot.stop_sign_m is not None:
            parts.append(f"stop sign in {shot.stop_sign_m:.0f} m")
        if frame.line is not None and frame.line <= len(self._source):
            parts.append(f"▸ {plain(self._source[frame.line - 1].strip()).plain}")
        self._live_line(Text("   ".join(parts), no_wrap=True, overflow="ellipsis"))

    def _live_line(self, line: RenderableType, style: str = "") -> None:
        if self._live is None:
            return
        if isinstance(line, Text) and style:
            line.stylize(style)
        if not self._waiting:
            self._live.start()
            self._waiting = True
        self._live.update(line)

    def _still(self) -> None:
        if self._live is not None and self._waiting:
            self._live.stop()
            self._waiting = False


class FullTeller(Teller):
    """Says everything in SI units, as it happens: the loop's letters, helpers, scores, provenance."""

    def begin(self, scenario: Scenario, seed: int) -> None:
        """Name the road."""
        title = plain(scenario.title or scenario.id)
        self.console.print(Text.assemble(title, f" ({scenario.id}, seed {words.seed_words(seed)})", style="dim"))
        super().begin(scenario, seed)

    def tell(self, event: DriveEvent) -> None:
        """Print a letter as it comes; show a frame on the live line."""
        if event.kind != "period":
            self._still()
        match event.value:
            case Instruction() as wish:
                said_by = f"  ({wish.person})" if wish.person else ""
                self._letter("I", Text.assemble(("“", "dim"), plain(wish.text), ("”", "dim"), (said_by, "dim")))
            case Context() as context:
                self._letter("C", plain(context.text))
            case History() as history if history.items:
                self._letter("H", history_words(history))
            case Plan() as plan:
                self._plan(plan)
            case tuple() as several:
                for verdict in several:
                    if isinstance(verdict, Verdict):
                        self._verdict(verdict)
            case Frame() as frame:
                for text in frame.said:
                    at = (f"{frame.observation.time_s:6.1f} s  ", "dim")
                    self.console.print(Text.assemble(at, ("“", "dim"), plain(text), ("”", "dim")))
            case _:
                pass
        super().tell(event)

    def _units(self, text: str) -> str:
        return text

    def _why_not(self, trip: Trip) -> tuple[str, ...]:
        """Why a wish was declined was told with its plan or its checks."""
        return () if trip.causes.refused else words.cause_words(trip.causes)

    def _rows(self, recorded: RecordedTrip) -> Iterator[tuple[str, RenderableType]]:
        """Scores and provenance; the letters have been told."""
        trip = recorded.trip
        yield "Judged", words.judged_words(trip) or "Not compared with the wish."
        for metric in trip.metrics:
            yield words.metric_name(metric.id), words.metric_value(metric)
        yield "Planner", plain(", ".join(part for part in (trip.plan.planner, trip.plan.model) if part))
        yield "Planned in", f"{trip.plan.latency_s:.2f} s"
        tokens = trip.plan.usage.prompt_tokens + trip.plan.usage.completion_tokens
        if tokens:
            cost = trip.plan.usage.cost_usd
            yield "Tokens", f"{tokens}" if cost is None else f"{tokens}, {cost:.4f} USD"
        record = dict(trip.record)
        yield "Scenario", plain(f"{trip.scenario} (sha256 {str(record.get('scenario_sha256', ''))[:12]})")
        yield "Seed", words.seed_words(trip.seed)
        yield "Chauffeur", f"{record.get('chauffeur', '')}, trip {trip.id}"

    def _letter(self, letter: str, body: RenderableType) -> None:
        self.console.print(columns([(Text(letter, "bold cyan not dim"), body)], indent=0))

    def _plan(self, plan: Plan) -> None:
        if plan.refusal:
            head = {ANSWERED: "Answer: ", ASKS: "Asks: "}.get(plan.intent, "Declined: ")
            self._letter("R", Text.assemble((head, "bold yellow"), plain(plan.refusal)))
            return
        self._thoughts(plan.thoughts, plan.intent)
        if isinstance(plan.policy, Program):
            source = plain(policy_words(plan.policy).rstrip("\n")).plain
            self._letter("P", Syntax(source, **_CODE))
        else:
            self._letter("P", plain(policy_words(plan.policy) or "none"))

    def _thoughts(self, thoughts: Thoughts, intent: str) -> None:
        body = plain(thoughts.text.strip() or "(no reasoning given)")
        self._letter("R", Text.assemble(body, (f"  [{intent}]", "dim")) if intent else body)

    def _verdict(self, verdict: Verdict) -> None:
        if verdict.mark in ("differs", "failed"):
            self._letter("V", _told(verdict, self._units, check=True))
            return
        if verdict.mark == "not_compared":
            said = Text(f"{words.MARKS[verdict.mark]} ").append_text(plain(words.not_compared_words(verdict)))
            self._letter("V", said.append(f"  {verdict.check}"))
            return
        # Of what passed, the doubts are on the page and in the recording.
        reason = verdict.reason.split(". ", 1)[0].rstrip(".") + "." if verdict.reason else "passed"
        mark = Text(f"{words.MARKS[verdict.mark]} ", words.MARK_STYLES[verdict.mark])
        self._letter("V", Text.assemble(mark, plain(reason), (f"  {verdict.check}", "dim")))


VIEW_COLUMNS = 56
"""Width of the view from the seat on a terminal, characters."""


def seat_view(image: CameraImage) -> Text:
    """A picture in half blocks: two pixels a character, one above the other."""
    from PIL import Image

    picture = Image.fromarray(image.pixels())
    rows = round(VIEW_COLUMNS * picture.height / picture.width / 2) * 2
    dots = picture.resize((VIEW_COLUMNS, rows), Image.Resampling.BOX).load()
    assert dots is not None
    text = Text(no_wrap=True)
    for row in range(0, rows, 2):
        for column in range(VIEW_COLUMNS):
            above, below = (Color.from_rgb(*dots[column, y]) for y in (row, row + 1))  # type: ignore[misc]
            text.append("▀", Style(color=above, bgcolor=below))
        text.append("\n" if row + 2 < rows else "")
    return text


def history_words(history: History) -> Text:
    """What is remembered that bears on the wish, a line each, and what of it contradicts itself."""
    lines: list[Text] = []
    for item in history.items:
        told = "; ".join(words.feedback_words(feedback) for feedback in item.feedback)
        facts = ", ".join(part for part in (item.intent, item.outcome, told) if part)
        lines.append(Text.assemble("“", plain(item.instruction), "” ", (f"({facts})", "dim")))
    now = datetime.now(UTC)
    lines.extend(Text(conflict.to_person(now), "yellow") for conflict in conflicts_in(history))
    return Text("\n").join(lines)


def _told(verdict: Verdict, units: Callable[[str], str], *, check: bool = False) -> RenderableType:
    """A verdict that is not as it should be: what is wrong and, of an explanation, each thing that is not so."""
    mark = Text(f"{words.MARKS[verdict.mark]} ", words.MARK_STYLES[verdict.mark])
    where = f"{verdict.check}, line {verdict.line}" if verdict.line else verdict.check
    tail = (f"  {where}", "dim") if check else ("", "")
    if verdict.alignment is not None:
        title, score = words.doubt_words(verdict.check), f" ({score_words(verdict.alignment)})" if check else ""
        told = [plain(units(mismatch_words(mismatch))) for mismatch in verdict.alignment.mismatches]
        head = Text.assemble(mark, (title, "bold"), score, tail)
        return Group(head, *(Padding(line, (0, 0, 0, 2)) for line in told))
    body = Text.assemble(mark, plain(units(verdict.reason)), tail)
    return Group(body, Padding(plain(verdict.remedy), (0, 0, 0, 2))) if verdict.remedy else body
