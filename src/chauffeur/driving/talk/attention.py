"""What the session listens to, and what it makes of it: words to act on, or a question whether they are meant.

Sound of this machine's microphone, or of a screen, goes to the ear. What the speech engine is not sure of is asked
back, and so is what a planner doubts: acted on only after a yes, said, typed or pressed. One question at a time.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from chauffeur.concept import MissingExtraError
from chauffeur.driving.emergency import stop_wanted
from chauffeur.driving.questions import ANSWER_WITHIN_S, NOT_MEANT
from chauffeur.driving.talk.asr_client import AsrClient, AsrListener, HeardAt, Trouble
from chauffeur.driving.talk.asr_process import AsrEngine
from chauffeur.driving.talk.messages import Answered, Button, HeardWords, Listening, Note, Said
from chauffeur.driving.talk.sound import Sound
from chauffeur.driving.talk.voice import Voice
from chauffeur.driving.talk.wish_queue import Words
from chauffeur.language.emergency import read_emergency
from chauffeur.language.meaning.turns import answer_in
from chauffeur.speech.base import Heard


@dataclass(frozen=True, slots=True)
class _Question:
    """Something that was heard, or that the car offers, and is driven only when the person says that they mean it."""

    shown: HeardWords
    heard: Heard
    until_s: float

    @property
    def own(self) -> bool:
        """Whether the car asks of its own accord."""
        return not self.shown.engine

    @property
    def dropped(self) -> str:
        """That it was not meant, in words."""
        if self.own:
            return NOT_MEANT
        return f"“{self.heard.text}” is not {'kept' if self.heard.hotword == 'evaluate' else 'driven'}."


class Attention:
    """Listens for one session."""

    def __init__(
        self,
        engine: AsrEngine | None,
        sound: Sound | None,
        voice: Voice | None,
        say: Callable[[Said], None],
        act: Callable[[str, Words], None],
    ) -> None:
        """Nobody is listened to yet.

        Args:
            engine: For speech; None where nobody listens.
            sound: Microphone of this machine; None where sound comes from a screen.
            voice: The car's own, which it must not listen to.
            say: Takes what is to be shown.
            act: Takes what was heard and is meant: its hotword, and the words.
        """
        self._ear = None if engine is None else AsrClient(engine)
        self._sound, self._voice, self._say, self._act = sound, voice, say, act
        self._question: _Question | None = None
        self._button = ""
        self._missing = ""
        self._refused_sound = self._muted = False

    @property
    def question(self) -> HeardWords | None:
        """What the person is asked about; None where nothing is."""
        return None if self._question is None else self._question.shown

    @property
    def engine(self) -> tuple[str, bool]:
        """Name of the engine, empty for none, and whether sound leaves this machine."""
        return ("", False) if self._ear is None else (self._ear.name, self._ear.remote)

    def start(self) -> None:
        """Begin. Where sound would come from a screen, and the engine is not installed, one types instead.

        Raises:
            ChauffeurError: The engine cannot be had.
        """
        if self._ear is None:
            return
        try:
            self._ear.__enter__()
        except MissingExtraError as error:
            if self._sound is not None:  # this machine's microphone was asked for
                raise
            self._ear = None
            self._missing = f"Speech is off: {error.message} {error.hint}".strip()

    def close(self) -> None:
        """Listen no more."""
        if self._ear is not None:
            self._ear.close()

    def introduce(self) -> None:
        """Tell how listening stands."""
        off = self._missing or "There is no speech engine."
        self._say(Listening("off", why=off) if self._ear is None else Listening(self._ear.state))
        if self._missing:
            self._say(Note(self._missing))

    def take_sound(self, chunk: bytes) -> None:
        """Sound of a screen; passed over where this machine has a microphone of its own."""
        if self._sound is None:
            self._pass_on(chunk)
        elif not self._refused_sound:
            self._refused_sound = True
            self._say(Note("The car listens to its own microphone, and not to this one."))

    def press(self, told: Button) -> None:
        """A button is held, or let go."""
        if self._ear is None or not self._ear.hears:
            self._say(Note("Nobody listens: hearing is off. Type what you want.", trouble=True))
            return
        self._ear.button(told.button, held=told.held)
        self._button = told.button if told.held else ""
        self._say(Listening(self._ear.state, self._button))

    def poll(self) -> None:
        """Hear what there is to hear."""
        if self._question is not None and time.monotonic() > self._question.until_s:
            self.withdraw(f"Nobody said yes: {self._question.dropped}")
        if self._ear is None:
            return
        self._take_microphone()
        for news in self._ear.poll():
            match news:
                case AsrListener():
                    self._button = "" if news.state == "off" else self._button
                    self._say(Listening(news.state, self._button, news.why))
                case Trouble():
                    self._say(Note(news.text, trouble=True))
                case HeardAt():
                    self._understand(news)

    def confirm(self, yes: bool, answer: Words) -> None:
        """Yes or no to what was asked; nothing where nothing was.

        Args:
            yes: Whether it is meant.
            answer: When the answer was there; its words do not matter.
        """
        question = self._question
        if question is None:
            return
        self.withdraw("" if yes else question.dropped)
        if yes:
            asked = question.shown.reason if question.own else ""
            spoken = answer.spoken or not question.own
            words = replace(answer, text=question.heard.text, spoken=spoken, confirmed=asked)
            self._act(question.heard.hotword or "command", words)

    def offer(self, question: str, wish: str) -> None:
        """The car's own question: a yes wishes what it offers.

        Args:
            question: In words.
            wish: What a yes stands for.
        """
        self.withdraw()
        shown = HeardWords("heard", wish, "command", "", None, to_confirm=True, reason=question, after_speech_s=0.0)
        self._ask_back(shown, Heard("heard", wish, "command", ""))
        self._say(shown)
        if self._voice is not None:
            self._voice.say(question)

    def _ask_back(self, shown: HeardWords, heard: Heard) -> None:
        self._question = _Question(shown, heard, time.monotonic() + ANSWER_WITHIN_S)
        if self._ear is not None:
            self._ear.expect_answer(True)

    def withdraw(self, why: str = "") -> None:
        """Ask no more, and say why."""
        if self._question is None:
            return
        self._question = None
        if self._ear is not None:
            self._ear.expect_answer(False)
        self._say(Answered("heard"))
        if why:
            self._say(Note(why))

    def _take_microphone(self) -> None:
        sound = self._sound
        if sound is None or self._ear is None:
            return
        for chunk in sound.take():
            self._pass_on(chunk)
        if sound.trouble:
            self._sound = None
            self._say(Note(f"{sound.trouble} Until then, please type.", trouble=True))
            self._say(Listening("off", why=sound.trouble))

    def _pass_on(self, chunk: bytes) -> None:
        """Sound to the ear, but for the car's own voice."""
        if self._ear is None:
            return
        speaking = self._voice is not None and self._voice.speaking
        if speaking and not self._muted:
            self._ear.forget()
        self._muted = speaking
        if not speaking:
            self._ear.sound(chunk)

    def _understand(self, at: HeardAt) -> None:
        heard = at.heard
        wait_s = max(0.0, at.at_s - at.ended_s - heard.timing.recognise_s)
        words = Words(heard.text, True, at.ended_s, wait_s, heard.timing.recognise_s)
        understood = heard.status == "heard"
        # With a button held, yes comes as a command.
        answers = understood and (heard.hotword is None or (self._question is not None and heard.hotword == "command"))
        answer = answer_in(heard.text) if answers else None
        at_once = stop_wanted(read_emergency(heard.text)) if understood else False  # a stop is not asked back
        asks = understood and heard.to_confirm and answer is None and not at_once
        shown = HeardWords(
            status=heard.status,
            text=heard.text,
            hotword=heard.hotword or "",
            engine=heard.engine,
            confidence=heard.confidence,
            to_confirm=asks,
            reason=" ".join((heard.reason, *heard.notes)).strip(),
            after_speech_s=max(0.0, at.at_s - at.ended_s),
        )
        if answer is None and (understood or heard.again):
            self.withdraw()  # something newer was said, or what was asked about was a part of this
        self._say(shown)
        if answer is not None:
            self.confirm(answer, words)
        elif asks:
            self._ask_back(shown, heard)
            if self._voice is not None:
                self._voice.say(f"Did you mean: {heard.text}?")
        elif understood:
            self._act(heard.hotword or "command", words)
