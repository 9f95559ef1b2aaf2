"""The terminal of `chauffeur vehicle drive`: what happens, what was heard, and what became of each wish."""

from __future__ import annotations

import time

from rich.console import Console
from rich.text import Text

from chauffeur.cli.console import echo, plain
from chauffeur.cli.labels import NOT_HEARD
from chauffeur.concept import Result
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.onroad.answers import OnRoadAnswer
from chauffeur.driving.talk.messages import HeardWords, Note, Said
from chauffeur.driving.talk.voice import Voice
from chauffeur.driving.talk.wish_queue import Words
from chauffeur.worlds.ros import Published
from chauffeur.worlds.ros.autoware_ai import AutowareAi
from chauffeur.worlds.ros.lines import command_line
from chauffeur.worlds.ros.settings import VehicleSettings


class VehicleScreen:
    """Prints events and answers as they come."""

    def __init__(
        self, console: Console, settings: VehicleSettings, *, dry_run: bool, quiet: bool, voice: Voice | None
    ) -> None:
        self._console, self._settings, self._dry_run, self._quiet = console, settings, dry_run, quiet
        self._voice = voice
        self.well = True

    def say(self, words: str, style: str = "") -> None:
        """A line."""
        if not self._quiet:
            self._console.print(plain(words), style=style)

    def tell(self, event: DriveEvent) -> None:
        """What the session tells."""
        match event.kind:
            case "link":
                self.say(f"Vehicle: {event.text}", "dim")
            case "plan":
                self.say(f"  thoughts  {event.text}", "dim")
            case "asked":
                self._lines(event.value)
            case "late" | "trouble":
                self.trouble(event.text)
            case "over":
                self.say(event.text)
            case _:
                pass

    def trouble(self, words: str) -> None:
        """Something that went wrong beside the wishes."""
        self.say(words, "bold yellow")

    def listens(self, engine: tuple[str, bool]) -> None:
        """Who listens, and where the sound goes."""
        name, remote = engine
        where = "leaves" if remote else "stays on"
        self.say(f"Speech: {name}; the sound {where} this machine. Say “command ...” or “evaluate ...”.", "dim")

    def hear(self, said: Said) -> None:
        """What the microphone gave."""
        match said:
            case HeardWords():
                self._heard(said)
            case Note():
                self.say(said.text, "bold yellow" if said.trouble else "")
            case _:
                pass

    def _heard(self, heard: HeardWords) -> None:
        if heard.status != "heard":
            self.say(f"{NOT_HEARD.get(heard.status, heard.status)} {heard.reason}".rstrip(), "yellow")
            return
        self.say(f"Heard {heard.after_speech_s:.2f} s after you spoke: “{heard.text}”", "cyan")
        if heard.to_confirm:
            self.say(f"Is that what you mean? Say or type yes or no. {heard.reason}".rstrip(), "bold yellow")

    def answer(self, answer: OnRoadAnswer, spoken: Words | None = None) -> None:
        """What became of a wish; of a spoken one also how long after the last word that was known."""

        done = answer.result is Result.DONE
        self.well = self.well and (done or answer.status == "superseded")
        style = "bold green" if done else "bold red"
        after = "" if spoken is None else f" ({time.monotonic() - spoken.ended_s:.2f} s after you spoke)"
        self._console.print(
            Text.assemble(plain(f"“{answer.text}” "), (answer.result, style), " ", plain(answer.words), (after, "dim"))
        )
        if self._voice is not None:
            self._voice.say(answer.words)

    def _lines(self, published: object) -> None:
        """In a dry run: the lines that would publish the same, unwrapped, to be copied."""
        if self._dry_run and not self._quiet and isinstance(published, Published):
            ros = 1 if isinstance(self._settings.stack, AutowareAi) else 2
            for message in published.messages:
                echo(command_line(message, ros))
