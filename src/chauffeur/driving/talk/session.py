"""A drive that one talks with: wish, thoughts, verdicts, driving, "how was it?", memory. For terminal and page alike.

A `Talk` is used from one thread: `take` what the person does, `poll` often, hear what it tells. Nothing in it waits:
the drive lives in processes of its own, and so does hearing; the memory has a thread. What goes wrong is told in words,
and the drive goes on.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Final, Self

from chauffeur.concept import NOBODY, ChauffeurError, Feedback, History, Limits, Observation, PersonId, Plan, Result
from chauffeur.concept.units import kmh
from chauffeur.driving.drive_session import DriveSession, Entrance
from chauffeur.driving.emergency import STOPPING, brings_to_a_stand, stop_wanted
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.live.messages import LiveEnd, Report
from chauffeur.driving.live.mirror import live_world
from chauffeur.driving.live.settings import Settings, ring
from chauffeur.driving.live.supervisor import Interaction, Runtime
from chauffeur.driving.recorder import DriveRecorder
from chauffeur.driving.talk.asr_process import AsrEngine
from chauffeur.driving.talk.attention import Attention
from chauffeur.driving.talk.conversations import Conversations
from chauffeur.driving.talk.memory_worker import CLOSE_WITHIN_S, Kept, MemoryWorker, OpinionKept
from chauffeur.driving.talk.messages import (
    Answered,
    Button,
    Confirm,
    Ended,
    Evaluate,
    Hand,
    HowWasIt,
    MemoryOrder,
    MemoryState,
    Note,
    Said,
    Say,
    SessionState,
    ShowSeat,
    Stop,
    TakeOver,
    Told,
)
from chauffeur.driving.talk.seat_view import SeatWindow
from chauffeur.driving.talk.sound import Sound
from chauffeur.driving.talk.tally import Tally
from chauffeur.driving.talk.view import View
from chauffeur.driving.talk.voice import Voice
from chauffeur.driving.talk.wish_queue import OVER, WishQueue, Words
from chauffeur.driving.trips import live_trip
from chauffeur.language.emergency import read_emergency
from chauffeur.memory.feedback import interpret_feedback
from chauffeur.safety.bounds import shoulder_at_right

ASK_AFTER_S: Final = 15.0
"""So long a wish is driven, in the car's time, before the car asks how it is: many have no end of their own."""
OPINION_WITHIN_S: Final = 2.0
"""An opinion that becomes a wish waits so long for its place in the memory, so that the planner finds it there."""
ABORTED_WITHIN_S: Final = 2.0
"""So long an end at once waits for the memory."""

_OUTCOMES: Final = {
    "ended": "The drive has ended.",
    "stopped": "The car stands; the drive is over.",
    "collision": "A collision ended the drive.",
    "off_road": "The car left the road.",
    "died": "Control died; in a vehicle, its gateway would have to brake now.",
    "aborted": "Broken off while driving.",
    "broken_off": "Broken off while driving.",
}
WELL: Final = frozenset({"ended", "stopped"})
"""Outcomes of a drive that ended as it should."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Change:
    """An opinion that becomes a wish once it is in the memory."""

    wish: str
    feedback: Feedback
    words: Words
    until_s: float


class Talk(DriveSession):
    """One session. Use as a context manager; afterwards the drive is over and what was to be kept is kept.

    Attributes:
        outcome: Of the drive, once it is over; empty before.
        tally: What control did, for the end.
    """

    leaving = "You end the session. The car comes to a stand, and the drive is over."

    def __init__(
        self,
        settings: Settings,
        tell: Callable[[Said], None],
        *,
        person: PersonId = NOBODY,
        books: DriveRecorder | None = None,
        engine: AsrEngine | None = None,
        sound: Sound | None = None,
        voice: Voice | None = None,
        most_s: float = float("inf"),
        ask_after_s: float = ASK_AFTER_S,
    ) -> None:
        """Set up; nothing moves yet.

        Args:
            settings: Of the drive. Its memory is the person's; the chosen one if it names none.
            tell: Hears all that is said, in the thread that polls.
            person: Whose wishes they are, and whose memory is used.
            books: Where the drive is written down, None for nowhere.
            engine: For speech; None where nobody listens.
            sound: Microphone of this machine; None where sound comes from a screen.
            voice: Speaks replies; None for silence.
            most_s: After so long, in the car's time, the car stops.
            ask_after_s: So long a wish is driven before the car asks how it is.
        """
        super().__init__(person, books)
        self._settings, self._show = settings, tell
        self._voice = voice
        self._attention = Attention(engine, sound, voice, self._say, self._act_on)
        self._most_s, self._ask_after_s = most_s, ask_after_s
        self._dt_s = live_world(settings.starts[0].scenario).dt_s
        self._runtime: Runtime | None = None
        self._view: View | None = None
        self._window = SeatWindow()
        self._looking = False
        self._keeper: MemoryWorker | None = None
        self._asking = WishQueue(person, books)
        self._conversations = Conversations(self._dt_s, time.monotonic)
        self._changes: list[_Change] = []
        self._newest: dict[str, Said] = {}
        self._asked_how: HowWasIt | None = None
        self._stopping = False
        self._driven_s = self._before_s = 0.0
        self._recent: tuple[str, float] = "", 0.0
        self.outcome = ""
        self.tally = Tally()

    def __enter__(self) -> Self:
        """Start hearing and driving.

        Raises:
            ChauffeurError: The speech engine cannot be had.
            SandboxError: A process of the drive could not be started.
        """
        try:
            self._attention.start()
            if self._person:
                self._keeper = MemoryWorker(self._person, memory=self._settings.memory)
            runtime = Runtime(self._settings, self._heard)
            self._runtime = runtime
            self._view = View(self._settings, ring(runtime.folder, "observations"))
            self._introduce()
            runtime.__enter__()
        except BaseException:
            self._close_parts()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._finish(broken=error is not None)

    def close(self) -> None:
        """End the drive, and keep what is to be kept."""
        self._finish(broken=False)

    @property
    def driving(self) -> bool:
        """Whether the drive goes on."""
        return self._runtime is not None and self._runtime.driving

    @property
    def taken_over(self) -> bool:
        """Whether the person has the wheel: as it was told, which may be before any picture shows it."""
        return self._runtime is not None and self._runtime.taken_over

    @property
    def stopping(self) -> bool:
        """Whether the car is brought to a stand."""
        return self._stopping

    @property
    def question(self) -> bool:
        """Whether the car waits for a yes or no."""
        return self._attention.question is not None

    @property
    def busy(self) -> bool:
        """Whether something that was said is still on its way to the planner."""
        return bool(self._changes) or self._asking.busy

    def snapshot(self) -> tuple[Said, ...]:
        """What a screen has to be told that joins now, in order; questions last."""
        order = ("session", "road", "scene", "listening", "memory")
        first = [self._newest[kind] for kind in order if kind in self._newest]
        questions = (self._asked_how, self._attention.question, self._newest.get("ended"))
        return (*first, *self._conversations, *(each for each in questions if each is not None))

    def poll(self) -> None:
        """Go on with everything; call it ten times a second at least, more often for exact latencies."""
        runtime = self._runtime
        if runtime is None:
            return
        self._guarded("The drive cannot be followed", runtime.poll)
        self._guarded("Hearing failed", self._attention.poll)
        self._guarded("A wish could not be handed on", self._ask)
        self._guarded("The memory failed", self._keep)
        self._guarded("The scene cannot be shown", self._look)
        if self._driven_s >= self._most_s and not self._stopping:
            self._say(Note("The time of this drive is over."))
            self.stop()

    def take(self, told: Told | bytes) -> None:
        """What the person does, or sound of theirs (16 kHz, 16 bit, little-endian, mono)."""
        self._guarded("That was not done", lambda: self._take(told))

    def abort(self) -> None:
        """End every process at once, wherever the car is."""
        if self._runtime is not None:
            self.outcome = "aborted"
            self._runtime.abort()

    # What the person does ---------------------------------------------------------------------------------------------

    def _take(self, told: Told | bytes) -> None:
        match told:
            case bytes():
                self._attention.take_sound(told)
            case Say():
                self.ask(told.text)
            case Confirm():
                self._attention.confirm(told.yes, Words("", ended_s=time.monotonic()))
            case Button():
                self._attention.press(told)
            case Evaluate():
                self._evaluate(told.text, told.wish, Words(told.text, ended_s=time.monotonic()))
            case TakeOver():
                self.take_over(told.on)
            case Hand():
                if self._runtime is not None:
                    self._runtime.hand(told.key)
            case ShowSeat():
                self._looking = told.on
            case Stop():
                self.stop()
            case MemoryOrder():
                if self._keeper is None:
                    self._say(Note("Nobody's memory is used. Begin with a name: chauffeur talk --as NAME.", True))
                else:
                    self._keeper.order(told)
                    if told.do == "private" and self._books is not None:
                        self._say(Note("The audit log of this drive goes on, and holds your words.", trouble=True))

    def ask(self, text: str) -> None:
        """Take typed words; what becomes of them is told."""
        words = Words(text.strip(), ended_s=time.monotonic())
        entrance = self.enter(words.text)
        if entrance.way in ("yes", "no"):
            self._attention.confirm(entrance.way == "yes", replace(words, text=""))
        else:
            self._attention.withdraw()
            self._wish(words, entrance)

    def feedback(self, text: str) -> None:
        """Keep an opinion on the last wish that was driven, which may wish for something else."""
        self._evaluate(text, "", Words(text, ended_s=time.monotonic()))

    def _wish(self, words: Words, entrance: Entrance | None = None) -> None:
        entrance = self.enter(words.text) if entrance is None else entrance
        stopping = self._stopping and entrance.way != "nothing"
        match entrance.way:
            case "opinion" | "wish" | "yes" | "no" if not stopping:
                if self.taken_over:
                    self._say(Note(f"You have the wheel; give it back before you wish for something: “{words.text}”."))
                elif entrance.way == "opinion" and not words.follows:
                    self._evaluate(words.text, "", words)
                else:
                    self._asking.put(words)
            case _ if stopping:
                self._say(Note(f"The car is stopping; “{words.text}” is not asked."))
                self._asking.pass_over(words.text, "unasked", Result.NOT_DONE, OVER)
            case "stop" | "leave":
                self._asking.pass_over(words.text, "halt", entrance.result, entrance.words or STOPPING)
                if entrance.words:
                    self._say(Note(entrance.words))
                self.stop()
            case "distress":
                self._asking.pass_over(words.text, "declined", entrance.result, entrance.words)
                self._attention.offer(entrance.words, entrance.offer)
            case _:
                self._asking.pass_over(words.text, "answered", entrance.result, entrance.words)
                self._say(Note(entrance.words))
                if entrance.way == "go_on":
                    self._speak(entrance.words)

    @property
    def _question_is_open(self) -> bool:
        return self.question

    @property
    def _was_driven(self) -> bool:
        return bool(self._conversations.last_felt)

    def _takes_back(self, cancelled: bool) -> bool:
        wishes = () if self._runtime is None else self._runtime.open_wishes
        return self.busy or any(cancelled or one.stage == "asked" for one in wishes)

    def _reaches_shoulder(self) -> bool:
        report = None if self._runtime is None else self._runtime.report
        now = None if report is None else self._instant(report.trip, report.tick)
        return now is None or shoulder_at_right(now)  # where nothing is seen yet, the planner process finds out

    def _stops_by_plan(self) -> bool:
        wishes = () if self._runtime is None else self._runtime.open_wishes
        driven = (one.brief for one in wishes if one.stage in ("planned", "driven"))
        return any(brief is not None and brings_to_a_stand(brief.plan) for brief in driven)

    def _act_on(self, hotword: str, words: Words) -> None:
        """What was heard and is meant."""
        if hotword == "evaluate":
            self._evaluate(words.text, "", words)
        else:
            self._wish(words)

    def take_over(self, on: bool) -> None:
        """The person takes the wheel, or gives it back; `Hand` moves the car meanwhile."""
        runtime = self._runtime
        if runtime is None or runtime.taken_over == on:
            return
        runtime.take_over(on)
        self._say(
            Note("You have the wheel: keys move the car, and no plan does.")
            if on
            else Note("The car has the wheel again. It keeps speed and lane until you wish for something.")
        )

    def stop(self) -> None:
        """Bring the car to a stand, and end the drive."""
        if self._runtime is None or self._stopping:
            return
        self._stopping = True
        self._attention.withdraw()
        self._say(Note(STOPPING))
        self._speak(STOPPING)
        self._runtime.halt()

    # Opinions ---------------------------------------------------------------------------------------------------------

    def _evaluate(self, text: str, wish: str, words: Words) -> None:
        said = " ".join(text.split())
        wish = wish or self._conversations.last_felt
        if not said:
            return
        if stop_wanted(read_emergency(said)):
            self._wish(replace(words, text=said))
            return
        if wish not in self._conversations:
            self._say(Note("Nothing was driven yet that there could be an opinion on."))
            return
        feedback = interpret_feedback(said)
        before = self._conversations[wish].opinion
        self._say(self._conversations.change(wish, opinion=f"{before}; {said}" if before else said))
        if self._asked_how is not None:
            self._asked_how = None
            self._say(Answered("how_was_it"))
        if self._keeper is not None:
            self._keeper.opinion(wish, feedback)
        if self._wishes_change(wish, feedback):
            closed = self._conversations[wish].stage == "closed"
            until_s = time.monotonic() + (OPINION_WITHIN_S if closed and self._keeper is not None else 0.0)
            self._changes.append(_Change(wish, feedback, replace(words, text=said, follows=wish), until_s))

    def _wishes_change(self, wish: str, feedback: Feedback) -> bool:
        """Whether an opinion asks for something else now: on an older wish, it is for the next time."""
        runtime = self._runtime
        if runtime is None or self._stopping or runtime.taken_over or not self._conversations.newest(wish):
            return False
        return feedback.strength > 0.0 and bool(feedback.speed or feedback.gap or feedback.comfort)

    def _ask(self) -> None:
        runtime = self._runtime
        if runtime is None:
            return
        now_s = time.monotonic()
        due = [change for change in self._changes if now_s >= change.until_s]
        self._changes = [change for change in self._changes if now_s < change.until_s]
        for change in due:
            self._wish(change.words)
        if self._stopping:
            return
        asked, note = self._asking.look(runtime)
        if note:
            self._say(Note(note, trouble=True))
        if asked is not None:
            self._say(self._conversations.asked(*asked))

    # The memory -------------------------------------------------------------------------------------------------------

    def _keep(self) -> None:
        if self._keeper is not None:
            for news in self._keeper.poll():
                self._kept(news)

    def _kept(self, news: Kept | OpinionKept | MemoryState | Note) -> None:
        match news:
            case Kept():
                self._say(self._conversations.change(news.wish, remembered=news.text))
                if news.trouble:
                    self._say(Note(news.trouble, trouble=True))
            case OpinionKept():
                self._changes = [
                    replace(change, until_s=0.0)
                    if (change.wish, change.feedback) == (news.wish, news.feedback)
                    else change
                    for change in self._changes
                ]
            case _:
                self._say(news)

    def _closed(self, interaction: Interaction) -> None:
        """Nothing more becomes of a wish."""
        runtime, keeper = self._runtime, self._keeper
        if runtime is None or keeper is None or interaction.answer is None:
            return
        trip = max(1, interaction.answer.trip or (0 if runtime.report is None else runtime.report.trip))
        start = self._settings.starts[min(trip, len(self._settings.starts)) - 1]
        keeper.trip(interaction.request.wish, live_trip(interaction, start, self._dt_s, runtime.report))

    # The drive --------------------------------------------------------------------------------------------------------

    def _heard(self, event: DriveEvent) -> None:
        """What the runtime tells."""
        self._tell(event)
        match event.value:
            case History() as history:
                self._conversations.recalled(event.wish, history)
            case Plan() as plan:
                self._say_if(self._conversations.plan(event.wish, plan))
            case Report() as report:
                self._report(report)
            case tuple() if event.wish in self._conversations and self._runtime is not None:
                self._say_if(self._conversations.verdicts(self._runtime.interactions[event.wish]))
            case str() as process:
                self._say(Note(f"The {process} process is replaced. {event.text}", trouble=True))
            case None:
                self._became(event)
            case _:
                pass

    def _became(self, event: DriveEvent) -> None:
        """What became of a wish."""
        if event.kind == "halt":
            self.stop()
            return
        runtime = self._runtime
        interaction = None if runtime is None else runtime.interactions.get(event.wish)
        conversation = self._conversations.event(event, interaction)
        if conversation is None:
            return
        self._say(conversation)
        if event.offer and not self._stopping:
            self._attention.offer(event.text, event.offer)
        elif event.kind in ("said", "declined", "refused", "answered"):
            self._speak(event.text)
        if interaction is not None and event.final:
            self._closed(interaction)

    def _report(self, report: Report) -> None:
        self.tally.add(report)
        if report.tick == 0 and report.trip > 1:
            self._before_s = self._driven_s
            self._say(Note("The road has ended; another one begins. Both are simulated."))
        self._driven_s = self._before_s + (report.tick + 1) * self._dt_s
        for text in report.said:
            self._say(Note(text))
            self._speak(text)
        self._say_if(self._conversations.report(report))

    def _look(self) -> None:
        view, runtime = self._view, self._runtime
        if view is None or runtime is None:
            return
        for shown in view.look(runtime.report):
            self._say_if(shown)
        if self._looking:
            view.offer(self._window)
            self._say_if(self._window.news())
        asked = self._conversations.to_ask_about(self._ask_after_s)
        if asked is not None and not self._stopping:
            self._asked_how = asked
            self._speak("How was it?")
            self._say(asked)

    def _instant(self, trip: int, tick: int) -> Observation | None:
        return None if self._view is None else self._view.at(trip, tick)

    # Beginning and end ------------------------------------------------------------------------------------------------

    def _introduce(self) -> None:
        start = self._settings.starts[0]
        engine, remote = self._attention.engine
        self._say(
            SessionState(
                scenario=start.scenario.id,
                title=start.scenario.title or start.scenario.id,
                seed=start.seed,
                planner=self._settings.planner,
                engine=engine,
                engine_remote=remote,
                person=self._person,
                vehicle="simulated",
                dt_s=self._dt_s,
                limits=limits_in_words(start.limits),
            )
        )
        self._attention.introduce()

    def _finish(self, *, broken: bool) -> None:
        runtime = self._runtime
        if runtime is None:
            return
        try:
            runtime.stop()
            self._conclude(runtime, broken=broken)
        finally:  # also when somebody has no more patience
            self._close_parts()

    def _conclude(self, runtime: Runtime, *, broken: bool) -> None:
        """The drive is over: say what became of everything, and keep what is to be kept."""
        report = runtime.report
        if not self.outcome and report is not None and report.ended:
            self.outcome = report.outcome
        self.outcome = self.outcome or ("broken_off" if broken else "died")
        for text in (*self._asking.give_up(runtime), *(change.words.text for change in self._changes)):
            self._say(Note(f"Not asked: “{text}”. {OVER}"))
        self.tally.end(runtime, died=self.outcome == "died")
        end = LiveEnd(self.outcome, self.tally.figures or {}, runtime.lost_reports)
        self._tell(DriveEvent("over", value=end))
        if self._keeper is not None:
            for news in self._keeper.close(ABORTED_WITHIN_S if self.outcome == "aborted" else CLOSE_WITHIN_S):
                self._kept(news)
        self._say(Ended(self.outcome, _OUTCOMES.get(self.outcome, self.outcome)))

    def _close_parts(self) -> None:
        self._attention.close()
        self._window.close()
        if self._runtime is not None:
            self._runtime.close()
        self._runtime = None

    # Telling ----------------------------------------------------------------------------------------------------------

    def _say(self, said: Said) -> None:
        if said.kind in ("session", "road", "scene", "listening", "memory", "ended"):
            self._newest[said.kind] = said
        try:
            self._show(said)
        except Exception:  # noqa: BLE001 - a screen that fails must not take the drive with it
            _log.exception("a screen failed")

    def _say_if(self, said: Said | None) -> None:
        if said is not None:
            self._say(said)

    def _speak(self, text: str) -> None:
        if self._voice is not None:
            self._voice.say(text)

    def _guarded(self, what: str, do: Callable[[], None]) -> None:
        """Do something; what goes wrong is told, and no more often than once in five seconds."""
        try:
            do()
        except Exception as error:  # noqa: BLE001 - the drive goes on whatever it is
            if not isinstance(error, ChauffeurError):
                _log.exception("%s", what)
            why = str(error) if isinstance(error, ChauffeurError) else f"{what}: {type(error).__name__}: {error}"
            before, at_s = self._recent
            now_s = time.monotonic()
            if why != before or now_s - at_s > 5.0:
                self._recent = why, now_s
                self._say(Note(why, trouble=True))


def limits_in_words(limits: Limits) -> tuple[str, ...]:
    """Bounds no plan may cross, one each."""
    cap = limits.max_speed_mps
    over = kmh(limits.max_over_limit_mps)
    return (
        *(() if cap is None else (f"never faster than {kmh(cap):.0f} km/h",)),
        f"at most {over:.0f} km/h above the sign" if over >= 0.5 else "never faster than the sign says",
        f"{limits.min_time_headway_s:g} s or more to the car ahead",
    )
