"""A session on the terminal: the conversation, below it how the car stands and what it hears, and the line being typed.

Everything comes from what the session says. Where lines cannot be rewritten, there is a line of status now and then.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from types import TracebackType
from typing import Final, Self

from rich.console import Console, Group
from rich.live import Live
from rich.syntax import Syntax
from rich.text import Text

from chauffeur.cli.console import columns, plain
from chauffeur.cli.labels import FALLBACK_LEVELS, NOT_HEARD
from chauffeur.cli.talk_typed import HELP
from chauffeur.concept import HELPERS_HEAD, Result
from chauffeur.concept.units import people_speed
from chauffeur.driving.talk.messages import (
    Answered,
    Conversation,
    Ended,
    HeardWords,
    HowWasIt,
    Listening,
    MemoryState,
    Note,
    Said,
    Scene,
    SessionState,
    StageTimes,
    VerdictShown,
)
from chauffeur.hmi import words

REFRESH_S: Final = 0.1
PLAIN_EVERY_S: Final = 5.0
"""The car's time between two status lines where they cannot be rewritten."""
_MOST_TYPED: Final = 2
_MOST_SOURCE: Final = 14
"""Lines of a program that are shown; the page shows all of it."""

_LEVELS: Final[dict[str, str]] = {**FALLBACK_LEVELS, "hand": "you have the wheel"}
_LISTENING: Final = {
    "off": ("not listening", "dim"),
    "idle": ("listening", "green"),
    "speaking": ("you speak", "bold cyan"),
    "recognising": ("understanding", "bold cyan"),
}


class TalkScreen:
    """Shows one session. Use as a context manager.

    Attributes:
        ended: How the drive ended, in words; empty before.
    """

    def __init__(self, console: Console) -> None:
        """Args: where to print."""
        self.console = console
        self._live = Live(console=console, transient=True, auto_refresh=False) if console.is_terminal else None
        self._drawn_s = 0.0
        self._plain_due_s = 0.0
        self._session: SessionState | None = None
        self._scene: Scene | None = None
        self._listening: Listening | None = None
        self._memory: MemoryState | None = None
        self._shown: dict[str, Conversation] = {}
        self._question = self._how = ""
        self._show_memory = False
        self.ended = ""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._still()

    @property
    def taken_over(self) -> bool:
        """Whether the person has the wheel."""
        return self._scene is not None and self._scene.taken_over

    def conversation(self, wish: str) -> Conversation | None:
        """A conversation as it stands."""
        return self._shown.get(wish)

    @property
    def conversations(self) -> tuple[Conversation, ...]:
        """All of them, oldest first."""
        return tuple(self._shown.values())

    @property
    def time_s(self) -> float:
        """The car's time in this trip."""
        return 0.0 if self._scene is None else self._scene.time_s

    def help(self) -> None:
        """What can be typed."""
        self.console.print(columns(HELP))

    def note(self, text: str, style: str = "yellow") -> None:
        """Something of the terminal's own."""
        self.console.print(Text(style=style).append_text(plain(text)))

    def tell(self, said: Said) -> None:
        """What the session says."""
        match said:
            case SessionState():
                self._session = said
                self._begin(said)
            case Scene():
                self._scene = said
                if self._live is None:
                    self._plain_status(said)
            case Listening():
                if said.state == "off" and said.why and self._listening is not None:
                    self._line("", "hearing", "yellow", plain(said.why))
                self._listening = said
            case HeardWords():
                self._heard(said)
            case Conversation():
                self._conversation(said)
            case HowWasIt():
                self._how = said.wish
                self._line(said.wish, "how was it?", "bold magenta", Text("Type ! and what you think, e.g. !too fast"))
            case Answered():
                self._answered(said)
            case MemoryState():
                self._remember(said)
            case Note():
                self._show_memory = said.text.startswith("What is remembered")
                self._line(
                    "", "trouble" if said.trouble else "note", "bold red" if said.trouble else "", plain(said.text)
                )
            case Ended():
                self._end(said)
            case _:
                pass

    def refresh(self, typed: str | None) -> None:
        """Draw the status anew, ten times a second at most; `typed` is None where nobody types."""
        now_s = time.monotonic()
        if self._live is None or now_s - self._drawn_s < REFRESH_S:
            return
        self._drawn_s = now_s
        lines = list(self._status())
        if typed is not None:
            width = max(20, self.console.width * _MOST_TYPED - 4)
            lines.append(Text.assemble(("› ", "bold cyan"), plain(typed[-width:]), ("▏", "dim")))
        if not self._live.is_started:
            self._live.start()
        self._live.update(Group(*lines), refresh=True)

    # What is told -----------------------------------------------------------------------------------------------------

    def _begin(self, session: SessionState) -> None:
        facts = f" ({session.scenario}, seed {words.seed_words(session.seed)}, planner {session.planner}; simulated)"
        self.console.print(Text.assemble(plain(session.title), plain(facts)), style="dim")
        self.console.print(Text(f"Bounds: {'; '.join(session.limits)}.", "dim"))
        if session.engine:
            where = "the sound leaves this machine" if session.engine_remote else "the sound stays on this machine"
            self.console.print(Text(f"Speech: {session.engine}; {where}.", "dim"))
        whose = f"Memory of {session.person}." if session.person else "Nobody's memory is used; nothing is kept."
        self.console.print(Text(f"{whose} Type what you want, or help.", "dim"))

    def _heard(self, heard: HeardWords) -> None:
        if heard.status != "heard":
            self._line("", NOT_HEARD.get(heard.status, heard.status), "yellow", plain(heard.reason))
            return
        if not heard.engine:  # the car's own question, and not what was heard
            self._question = heard.text
            self._line("", "question", "bold yellow", Text(f"{heard.reason} Say or type yes or no."))
            return
        sure = "" if heard.confidence is None else f", {heard.confidence:.0%} sure"
        after = Text(f"  ({heard.after_speech_s:.2f} s after you spoke{sure})", "dim")
        name = "heard" if heard.hotword != "evaluate" else "opinion"
        self._line("", name, "cyan", Text.assemble("“", plain(heard.text), "”", after))
        if heard.to_confirm:
            self._question = heard.text
            self._line("", "meant?", "bold yellow", Text("Say or type yes or no."))

    def _answered(self, said: Answered) -> None:
        if said.question == "heard":
            self._question = ""
        else:
            self._how = ""

    def _conversation(self, now: Conversation) -> None:
        """Print what is new in it."""
        before = self._shown.get(now.wish)
        self._shown[now.wish] = now
        if before is None:
            before = Conversation(now.wish, now.text)
            how = " (your opinion, as a wish)" if now.follows else " (spoken)" if now.spoken else ""
            self._line(now.wish, "asked", "bold cyan", Text.assemble("“", plain(now.text), "”", (how, "dim")))
        for line in now.recalled if now.recalled != before.recalled else ():
            self._line(now.wish, "recalls", "blue", plain(line))
        if now.thoughts and now.thoughts != before.thoughts:
            self._line(now.wish, "thinks", "cyan", plain(now.thoughts))
        if now.source and now.source != before.source:
            self._policy(now)
        if now.verdicts and now.verdicts != before.verdicts:
            self._line(now.wish, "checks", "", _verdicts(now.verdicts))
        if now.waits and not before.waits:
            self._line(now.wish, "waits", "yellow", Text("Pending. “Never mind” takes it back."))
        if now.stage == "driven" and before.stage != "driven":
            self._line(now.wish, "drives", "green", plain(now.why))
        for text in now.said[len(before.said) :]:
            self._line(now.wish, "says", "magenta", Text.assemble("“", plain(text), "”"))
        if now.why and now.why != before.why and now.stage in ("asked", "planned"):
            self._line(now.wish, "why", "yellow", plain(now.why))
        if now.stages.total_s is not None and before.stages.total_s is None:
            self._line(now.wish, "latency", "dim", Text(stages_in_words(now.stages), "dim"))
        if now.outcome and now.outcome != before.outcome:
            label, style = _result(now)
            ended = "The program has ended; what it wished stays. " if now.outcome == "finished" else ""
            why = f"{ended}{now.why}".rstrip()
            self._line(now.wish, label, style, plain(why))
        if now.opinion != before.opinion:
            self._line(now.wish, "opinion", "magenta", Text.assemble("“", plain(now.opinion), "”"))
        if now.remembered != before.remembered:
            self._line(now.wish, "memory", "blue", plain(now.remembered))

    def _policy(self, now: Conversation) -> None:
        lines = now.source.partition(HELPERS_HEAD)[0].strip().splitlines()
        more = f"\n... {len(lines) - _MOST_SOURCE} more lines" if len(lines) > _MOST_SOURCE else ""
        text = "\n".join(lines[:_MOST_SOURCE]) + more
        if now.policy == "program" and self._live is not None:
            body: Syntax | Text = Syntax(plain(text).plain, "python", theme="ansi_dark", background_color="default")
        else:
            body = Text(style="dim").append_text(plain(text))
        self.console.print(columns([(self._name(now.wish, now.policy, ""), body)], indent=0))

    def _remember(self, state: MemoryState) -> None:
        before, self._memory = self._memory, state
        if state.private and before is None:
            self._line("", "private", "bold yellow", Text("Nothing new is kept."))
        if not state.encrypted and before is None:
            self._line(
                "", "memory", "yellow", plain(f"Kept in the memory “{state.memory}”; the car does not encrypt it.")
            )
        if self._show_memory:
            self._show_memory = False
            kept = "until erased" if state.retention_days is None else f"for {state.retention_days:g} days"
            self._line("", "memory", "blue", Text(f"{state.count} trips, kept {kept}."))
            for each in state.newest:
                said = f" — you said “{each.opinion}”" if each.opinion else ""
                when = each.when[:16].replace("T", " ")
                self._line("", "", "", plain(f"{when}  “{each.text}” {each.outcome}{said}"))

    def _end(self, ended: Ended) -> None:
        self.ended = ended.text
        self._still()
        style = "bold" if ended.outcome in ("ended", "stopped") else "bold red"
        self.console.print(Text.assemble((ended.text, style), (" (simulated drive)", "dim")))
        self.console.print(columns((each.wish, _summary(each)) for each in self._shown.values()))

    # Lines ------------------------------------------------------------------------------------------------------------

    def _line(self, wish: str, label: str, style: str, body: Text) -> None:
        self.console.print(columns([(self._name(wish, label, style), body)], indent=0))

    def _name(self, wish: str, label: str, style: str) -> Text:
        return Text.assemble((f"{self.time_s:6.1f} s  {wish:<3} ", "dim"), (f"{label:<11}", f"{style} not dim".strip()))

    def _status(self) -> Iterator[Text]:
        scene = self._scene
        if scene is None:
            yield Text("starting control, policy and planner ...", "dim")
            return
        yield _line_of(scene)
        facts: list[Text] = []
        if self._listening is not None:
            words_now, style = _LISTENING[self._listening.state]
            facts.append(Text(words_now, style))
        if self._memory is not None and self._memory.private:
            facts.append(Text("PRIVATE: nothing is kept", "bold yellow"))
        elif self._memory is not None:
            facts.append(Text(f"memory of {self._memory.person}: {self._memory.count} trips"))
        if scene.missed:
            facts.append(Text(f"missed {scene.missed} periods", "red"))
        if scene.shield:
            facts.append(Text(f"shield: {scene.shield}", "bold yellow"))
        if facts:
            yield Text("   ", "dim").join(facts)
        if self._question:
            yield Text.assemble(
                ("Did you mean: “", "bold yellow"), plain(self._question), ("”? yes or no", "bold yellow")
            )
        elif self._how:
            yield Text(f"How was {self._how}? e.g. !too fast", "magenta")

    def _plain_status(self, scene: Scene) -> None:
        if scene.time_s >= self._plain_due_s or scene.time_s < self._plain_due_s - PLAIN_EVERY_S:
            self._plain_due_s = scene.time_s + PLAIN_EVERY_S
            self.console.print(_line_of(scene))

    def _still(self) -> None:
        if self._live is not None and self._live.is_started:
            self._live.stop()


def stages_in_words(stages: StageTimes) -> str:
    """Where the time from the end of speech to the changed set-point went."""
    parts = (
        ("waiting", stages.wait_s), ("recognising", stages.recognise_s), ("planning", stages.plan_s),
        ("checking", stages.check_s), ("to the set-point", stages.set_point_s),
    )  # fmt: skip
    told = ", ".join(f"{name} {value:.2f}" for name, value in parts if value)
    return f"{stages.total_s or 0.0:.2f} s from your words to the changed set-point: {told}"


def _verdicts(verdicts: tuple[VerdictShown, ...]) -> Text:
    found = Text()
    for verdict in verdicts:
        mark = verdict.mark
        found.append(f"{words.MARKS[mark]} ", words.MARK_STYLES[mark]).append_text(plain(verdict.check)).append("  ")
        if not verdict.passed:
            found.append_text(plain(verdict.reason)).append("  ")
    return found


def _line_of(scene: Scene) -> Text:
    target = "" if scene.target_mps is None else f" → {people_speed(scene.target_mps, at_most=True)}"
    parts = [
        Text(f"{scene.time_s:6.1f} s"),
        Text(f"{people_speed(scene.ego.speed_mps)}{target}", "bold"),
        Text(f"limit {people_speed(scene.limit_mps, at_most=True)}"),
    ]
    if scene.place is not None:
        parts.append(Text(f"lane {scene.place + 1} from left"))
    if scene.level != "follow":
        parts.append(Text(_LEVELS[scene.level], "bold yellow"))
    parts.append(Text(f"{scene.wish}{f', line {scene.line}' if scene.line else ''}" if scene.wish else "no plan"))
    return Text("   ").join(parts)


def _result(each: Conversation) -> tuple[str, str]:
    """What became of a wish, and its style."""
    if not each.result:
        return each.stage, ""
    return each.result, {"good": "bold green", "neutral": "bold yellow", "bad": "bold red"}[
        words.RESULT_TONES[Result(each.result)]
    ]


def _summary(each: Conversation) -> Text:
    label, style = _result(each)
    if each.outcome in ("superseded", "interrupted") and each.stages.check_s is not None and not each.ends:
        label, style = "driven", "green"
    found = Text.assemble("“", plain(each.text), "” ", (label, style))
    if each.opinion:
        found.append_text(Text.assemble("; you said “", plain(each.opinion), "”"))
    if each.remembered:
        found.append_text(Text.assemble("; ", plain(each.remembered)))
    return found
