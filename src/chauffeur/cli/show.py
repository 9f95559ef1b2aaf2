"""A drive on the terminal: the loop's letters as they come, a live line while it moves, and what came of it."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.padding import Padding
from rich.syntax import Syntax
from rich.text import Text

from chauffeur.cli.console import columns, path_text, plain
from chauffeur.concept import (
    Alignment,
    Context,
    Frame,
    History,
    Instruction,
    Plan,
    Program,
    Scenario,
    Thoughts,
    Verdict,
)
from chauffeur.drive.answering import ANSWERED
from chauffeur.drive.recording import RecordedTrip
from chauffeur.hmi import words
from chauffeur.hmi.payload import policy_words
from chauffeur.memory.conflicts import conflicts_in
from chauffeur.safety.alignment import mismatch_words, score_words
from chauffeur.safety.words import reasons_once

_UNDRIVEN: dict[str, tuple[str, words.Tone]] = {
    ANSWERED: ("Answered, nothing driven", "neutral"),
    "ask": ("Asked back, nothing driven", "neutral"),
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

    def tell(self, letter: str, value: object) -> None:
        """One of the loop's letters, or a frame."""
        if letter == "memory":  # what went wrong with it is said even where little is
            self.console.print(plain(str(value)), style="bold yellow")

    def writing(self, text: str, attempt: int) -> None:
        """A piece of a model's reply as it is written."""

    def end(self, recorded: RecordedTrip) -> None:
        """What came of it."""
        trip = recorded.trip
        label, tone = _UNDRIVEN.get(trip.plan.intent if trip.plan.refusal else "", words.outcome_words(trip.outcome))
        line = Text(label, _STYLES[tone])
        if recorded.frames:
            line.append(f" after {trip.duration_s:.1f} s", style="not bold")
        if words.unexplained(trip.verdicts):
            line.append(", not as explained", style="yellow")
        self.console.print(line.append(" (simulated drive)", style="dim"))
        if not recorded.frames:
            self._why(trip.causes.detail)

    def _why(self, detail: str) -> None:
        self.console.print(plain(detail))

    def again(self) -> None:
        """The person has said yes: the same drive once more."""

    def wrote(self, paths: list[Path]) -> None:
        """Files of the trip."""


class Teller(Quiet):
    """Says everything, in the order in which it happens."""

    def __init__(self, console: Console) -> None:
        super().__init__(console)
        # A line that rewrites itself makes sense on a terminal only.
        self._live = Live(console=console, transient=True, refresh_per_second=10) if console.is_terminal else None
        self._waiting = False
        self._reply, self._attempt = "", 0
        self._given: set[str] = set()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._still()

    def begin(self, scenario: Scenario, seed: int) -> None:
        """Name the road."""
        title = plain(scenario.title or scenario.id)
        self.console.print(Text.assemble(title, f" ({scenario.id}, seed {words.seed_words(seed)})", style="dim"))

    def tell(self, letter: str, value: object) -> None:
        """Print a letter as it comes; show a frame on the live line."""
        match value:
            case Frame():
                self._frame(value)
            case Instruction():
                said_by = f"  ({value.person})" if value.person else ""
                self._letter("I", Text.assemble(("“", "dim"), plain(value.text), ("”", "dim"), (said_by, "dim")))
            case Context():
                self._letter("C", plain(value.text))
            case History():
                self._history(value)
                self._live_line(Text("planning ...", "dim"))
            case Plan():
                self._still()
                self._plan(value)
            case tuple() if letter == "V":
                self._still()
                verdicts = [verdict for verdict in value if isinstance(verdict, Verdict)]
                for verdict in () if self._given else verdicts:  # a plan that declines has been told with its reason
                    self._verdict(verdict)
            case _:
                super().tell(letter, value)

    def writing(self, text: str, attempt: int) -> None:
        """Show the end of what the model has written so far; a new attempt begins anew."""
        self._reply = text if attempt != self._attempt else self._reply + text
        self._attempt = attempt
        latest = " ".join(self._reply[-400:].split())[-160:]
        self._live_line(Text.assemble(("planning ... ", "dim"), plain(latest)))

    def end(self, recorded: RecordedTrip) -> None:
        """Outcome, causes, scores, provenance."""
        self._still()
        trip = recorded.trip
        self.console.print()
        super().end(recorded)
        for cause in words.cause_words(trip.causes):
            if cause in self._given or (self._given and cause == words.DECLINED):
                continue
            self.console.print(Padding(plain(cause), (0, 0, 0, 2)))
        shielded = words.shield_words([change for frame in recorded.frames for change in frame.interventions])
        if shielded:
            self.console.print(Padding(plain(shielded), (0, 0, 0, 2)))
        if trip.metrics:
            self.console.print(columns((words.metric_name(m.id), words.metric_value(m)) for m in trip.metrics))
        facts = [f"planner {trip.plan.planner}"]
        if trip.plan.model:
            facts.append(f"model {trip.plan.model}")
        facts.append(f"planned in {trip.plan.latency_s:.2f} s")
        tokens = trip.plan.usage.prompt_tokens + trip.plan.usage.completion_tokens
        if tokens:
            facts.append(f"{tokens} tokens")
        if trip.plan.usage.cost_usd is not None:
            facts.append(f"{trip.plan.usage.cost_usd:.4f} USD")
        record = dict(trip.record)
        facts.append(f"scenario {trip.scenario} (sha256 {str(record.get('scenario_sha256', ''))[:12]})")
        facts += [f"seed {words.seed_words(trip.seed)}", f"chauffeur {record.get('chauffeur', '')}", f"trip {trip.id}"]
        self.console.print(Padding(plain(", ".join(facts)), (0, 0, 0, 2)), style="dim")

    def _why(self, detail: str) -> None:
        """Told already, or below."""

    def again(self) -> None:
        """What was asked about is no reason any more."""
        self._still()
        self._given.clear()

    def wrote(self, paths: list[Path]) -> None:
        """List the files."""
        names = {".mcap": "recording", ".html": "page", ".png": "filmstrip"}
        self.console.print(columns((names.get(p.suffix, "file"), path_text(p)) for p in paths))

    def _letter(self, letter: str, body: RenderableType) -> None:
        self.console.print(columns([(Text(letter, "bold cyan not dim"), body)], indent=0))

    def _history(self, history: History) -> None:
        if not history.items:
            return
        lines: list[Text] = []
        for item in history.items:
            told = "; ".join(words.feedback_words(feedback) for feedback in item.feedback)
            facts = ", ".join(part for part in (item.intent, item.outcome, told) if part)
            lines.append(Text.assemble("“", plain(item.instruction), "” ", (f"({facts})", "dim")))
        now = datetime.now(UTC)
        lines.extend(Text(conflict.to_person(now), "yellow") for conflict in conflicts_in(history))
        self._letter("H", Text("\n").join(lines))

    def _plan(self, plan: Plan) -> None:
        if plan.refusal:
            self._given.add(plan.refusal)
            head = {ANSWERED: "Answer: ", "ask": "Asks: "}.get(plan.intent, "Declined: ")
            self._letter("R", Text.assemble((head, "bold yellow"), plain(plan.refusal)))
            return
        self._thoughts(plan.thoughts, plan.intent)
        if isinstance(plan.policy, Program):
            source = plain(policy_words(plan.policy).rstrip("\n")).plain
            code = Syntax(source, "python", theme="ansi_dark", background_color="default", word_wrap=True)
            self._letter("P", code)
        else:
            self._letter("P", plain(policy_words(plan.policy) or "none"))

    def _thoughts(self, thoughts: Thoughts, intent: str) -> None:
        body = plain(thoughts.text.strip() or "(no reasoning given)")
        self._letter("R", Text.assemble(body, (f"  [{intent}]", "dim")) if intent else body)

    def _verdict(self, verdict: Verdict) -> None:
        if verdict.alignment is not None and not verdict.passed:
            self._mismatches(verdict.check, verdict.alignment)
            return
        mark = Text("✓ ", "green") if verdict.passed else Text("✕ " if verdict.stops else "≠ ", "bold red")
        refused = reasons_once([verdict])
        if refused and refused in self._given:
            return  # another check has said so
        if refused:
            self._given.add(refused)
        # Of what passed, the doubts are on the page and in the recording.
        reason = verdict.reason.split(". ", 1)[0].rstrip(".") + "." if verdict.passed else refused or verdict.reason
        where = f"{verdict.check}, line {verdict.line}" if verdict.line else verdict.check
        body = Text.assemble(mark, plain(reason if verdict.reason else "passed"), (f"  {where}", "dim"))
        if verdict.remedy and not verdict.passed:
            body.append_text(Text("\n  ") + plain(verdict.remedy))
        self._letter("V", body)

    def _mismatches(self, check: str, alignment: Alignment) -> None:
        """What the explanation says that is not so; nothing stops for it."""
        title, score = words.doubt_words(check), score_words(alignment)
        head = Text.assemble(("≠ ", "bold yellow"), (title, "bold"), f" ({score})", (f"  {check}", "dim"))
        told = [Padding(plain(mismatch_words(mismatch)), (0, 0, 0, 2)) for mismatch in alignment.mismatches]
        self._letter("V", Group(head, *told))

    def _frame(self, frame: Frame) -> None:
        shot = frame.snapshot
        for text in frame.said:
            line = Text.assemble((f"{shot.time_s:6.1f} s  ", "dim"), ("“", "dim"), plain(text), ("”", "dim"))
            self.console.print(line)
        if self._live is None:
            return
        parts = [f"{shot.time_s:6.1f} s", f"{words.speed(shot.ego.speed_mps):>20}"]
        if shot.front is not None:
            parts.append(f"gap {shot.front.distance_m:5.1f} m")
        if shot.stop_sign_m is not None:
            parts.append(f"stop sign in {shot.stop_sign_m:.0f} m")
        if frame.line is not None:
            parts.append(f"line {frame.line}")
        self._live_line(Text("   ".join(parts)))

    def _live_line(self, line: Text) -> None:
        if self._live is None:
            return
        if not self._waiting:
            self._live.start()
            self._waiting = True
        self._live.update(line)

    def _still(self) -> None:
        if self._live is not None and self._waiting:
            self._live.stop()
            self._waiting = False
