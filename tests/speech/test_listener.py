"""From a stream to what was heard: hotwords, buttons, failures, and what becomes of the sound."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loudness import Loudness

from chauffeur.concept import ConfigError
from chauffeur.speech.audio import Recording, Samples
from chauffeur.speech.base import Expect, Transcript
from chauffeur.speech.detector import FRAME
from chauffeur.speech.errors import RecogniserError
from chauffeur.speech.listener import Listener, hear_recording, split_hotword


class Scripted:
    """An engine that says what the test wants, and keeps hold of the sound, to see what becomes of it."""

    name = "scripted/1"

    def __init__(self, *texts: str, remote: bool = False, fails: bool = False) -> None:
        self._texts = iter(texts)
        self.remote = remote
        self.fails = fails
        self.given: list[Samples] = []
        self.was_loud: list[bool] = []
        self.expected: list[Expect] = []

    def recognise(self, samples: Samples, expect: Expect = "open") -> Transcript:
        self.given.append(samples)
        self.was_loud.append(bool(samples.any()))
        self.expected.append(expect)
        if self.fails:
            raise RecogniserError("The engine is gone.", hint="Say it again.")
        text = next(self._texts, "")
        return Transcript(text, 0.9, to_confirm="lane" in text, reason="" if text else "Nothing known.")


def words(seconds: float = 0.8) -> bytes:
    """Speech to a detector of loudness, and the silence behind it."""
    rng = np.random.default_rng(2)
    loud = rng.integers(-8000, 8000, size=int(seconds * 16000) // FRAME * FRAME)
    return np.concatenate([loud, np.zeros(24 * FRAME)]).astype(np.int16).tobytes()


@pytest.mark.parametrize(
    ("text", "hotword", "rest"),
    [
        ("Command: slow down.", "command", "slow down."),
        ("command, please stop", "command", "please stop"),
        (" COMMAND ... go", "command", "go"),
        ("“Evaluate – that was fine”", "evaluate", "– that was fine”"),
        ("Commander, stop", None, "Commander, stop"),
        ("recommend stop", None, "recommend stop"),
        ("please command stop", None, "please command stop"),
        ("command", "command", ""),
        ("", None, ""),
    ],
)
def test_the_hotword_is_the_first_word(text: str, hotword: str | None, rest: str) -> None:
    assert split_hotword(text) == (hotword, rest)


@given(st.text(max_size=60))
def test_no_text_breaks_the_hotword(text: str) -> None:
    hotword, rest = split_hotword(text)
    assert rest in text and (hotword is not None or rest == text.strip())


def test_an_open_microphone_hears_what_follows_a_hotword() -> None:
    engine = Scripted("Command: slow down", "evaluate too fast", "I said nothing to you", "", "command")
    listener = Listener(engine, Loudness())
    found = list(itertools.chain.from_iterable(listener.feed(words()) for _ in range(5)))
    assert [(h.status, h.hotword, h.text) for h in found] == [
        ("heard", "command", "slow down"),
        ("heard", "evaluate", "too fast"),
        ("no_hotword", None, ""),
        ("not_understood", None, ""),
        ("not_understood", "command", ""),
    ]
    assert all(h.reason for h in found[2:]) and not any(h.reason for h in found[:2])
    assert engine.expected == ["open"] * 5
    assert all(h.confidence == 0.9 and h.engine == "scripted/1" for h in found)


def test_a_button_needs_no_hotword_and_joins_what_was_said_in_pieces() -> None:
    engine = Scripted("change to the left lane")
    listener = Listener(engine, Loudness())
    listener.press("command")
    assert listener.feed(words()) == [] and listener.feed(words(0.5)[: -20 * FRAME]) == []
    heard = listener.release()
    assert (heard.status, heard.hotword, heard.button, heard.text) == (
        "heard", "command", True, "change to the left lane",
    )  # fmt: skip
    assert heard.to_confirm and engine.expected == ["command"] and len(engine.given) == 1
    assert heard.timing.speech_s > 1.2
    with pytest.raises(ConfigError, match="No button"):
        listener.release()


def test_a_button_means_what_it_means_whatever_hotword_is_said() -> None:
    listener = Listener(Scripted("command that was fine"), Loudness())
    listener.press("evaluate")
    listener.feed(words())
    heard = listener.release()
    assert (heard.hotword, heard.text) == ("evaluate", "that was fine")


def test_a_button_pressed_in_silence_and_words_before_it() -> None:
    engine = Scripted("command stop")
    listener = Listener(engine, Loudness())
    listener.feed(words()[: 12 * FRAME * 2])
    listener.press("command")
    listener.feed(bytes(64_000))
    assert listener.release().status == "nothing"
    assert engine.given == []


def test_nothing_goes_to_a_remote_engine_unless_a_button_is_held_or_it_is_wanted() -> None:
    engine = Scripted("command stop", "command stop", remote=True)
    listener = Listener(engine, Loudness())
    assert listener.feed(words()) == [] and listener.finish() == [] and engine.given == []
    listener.press("command")
    listener.feed(words())
    assert listener.finish()[0].text == "stop"
    assert Listener(engine, Loudness(), open_microphone=True).feed(words())[0].text == "stop"


def test_too_long_is_not_half_driven() -> None:
    engine = Scripted("command stop")
    (heard,) = Listener(engine, Loudness()).feed(words(17.0))
    assert heard.status == "not_understood" and "15 s" in heard.reason and engine.given == []
    listener = Listener(engine, Loudness())
    listener.press("command")
    most = 0
    for _ in range(40):
        listener.feed(words())
        most = max(most, listener.held_bytes)
    assert "15 s" in listener.release().reason and engine.given == []
    assert most < 3 * 15 * 32_000


@pytest.mark.parametrize("fails", [False, True])
def test_the_sound_is_overwritten_as_soon_as_it_was_heard(fails: bool) -> None:
    engine = Scripted("command stop", fails=fails)
    listener = Listener(engine, Loudness())
    (heard,) = listener.feed(words())
    assert heard.status == ("failed" if fails else "heard")
    assert (heard.reason == "The engine is gone. Say it again.") == fails
    assert engine.was_loud == [True] and not engine.given[0].any()
    assert not listener._segments._kept.any()
    listener.feed(words()[:9000])
    listener.stop()
    assert not listener._segments._kept.any() and not listener._held


def test_an_engine_that_breaks_unexpectedly_does_not_keep_the_sound_either() -> None:
    class Broken(Scripted):
        def recognise(self, samples: Samples, expect: Expect = "open") -> Transcript:
            self.given.append(samples)
            raise ZeroDivisionError

    engine = Broken()
    listener = Listener(engine, Loudness())
    with pytest.raises(ZeroDivisionError):
        listener.feed(words())
    assert not engine.given[0].any()
    (sound,) = [np.frombuffer(words(), np.int16).copy()]
    with pytest.raises(ZeroDivisionError):
        hear_recording(Recording(sound), engine, Loudness())
    assert not sound.any()


def test_a_recording_is_heard_in_order_and_erased() -> None:
    sound = np.frombuffer(words() + words(), np.int16).copy()
    recording = Recording(sound, ("It is noted.",))
    found = hear_recording(recording, Scripted("command stop", "command go"), Loudness())
    assert [h.text for h in found] == ["stop", "go"] and not sound.any()
    assert all(h.notes == ("It is noted.",) for h in found)


def test_clipping_is_said() -> None:
    loud = np.where(np.arange(16000) % 2, 32767, -32768)
    sound = np.concatenate([loud, np.zeros(24 * FRAME)]).astype(np.int16)
    (heard,) = Listener(Scripted("command stop"), Loudness()).feed(sound)
    assert "clipped" in heard.notes[0]


def test_durations_are_those_of_the_clock() -> None:
    ticks = itertools.count()
    listener = Listener(Scripted("command stop"), Loudness(), clock=lambda: float(next(ticks)))
    (heard,) = listener.feed(words(0.64))
    assert heard.timing.recognise_s == 1.0
    assert heard.timing.speech_s == pytest.approx(0.64) and heard.timing.wait_s == pytest.approx(0.704)
    assert heard.timing.detect_s == 20 + 22
    assert heard.timing.after_speech_s == pytest.approx(1.704)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(["feed", "press", "release", "stop"]), st.integers(0, 60_000)), max_size=12))
def test_no_order_of_events_breaks_it(events: list[tuple[str, int]]) -> None:
    listener = Listener(Scripted(*["command stop"] * 99), Loudness())
    sound = itertools.cycle([words(), bytes(5000)])
    for event, size in events:
        if event == "feed":
            listener.feed(next(sound)[:size])
        elif event == "press":
            listener.press("command")
        elif event == "release":
            try:
                assert listener.release().button
            except ConfigError:
                assert listener._button is None
        else:
            listener.stop()
        assert listener.held_bytes < 3 * 15 * 32_000
    listener.finish()
    assert not listener._segments._kept.any()
