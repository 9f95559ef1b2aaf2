"""Spoken replies: text is data, the program may be missing, hang or fail, and nothing of it stops the car."""

from __future__ import annotations

import shutil
import stat
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.speech.audio import decode
from chauffeur.speech.say import MOST_CHARS, can_speak, render, say, speakable

needs_espeak = pytest.mark.skipif(shutil.which("espeak-ng") is None, reason="espeak-ng is not installed")


def stand_in(folder: Path, script: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another program by the name of espeak-ng."""
    program = folder / "espeak-ng"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(program.stat().st_mode | stat.S_IEXEC)
    monkeypatch.setenv("PATH", f"{folder}:/usr/bin:/bin")


@needs_espeak
def test_a_reply_becomes_sound() -> None:
    pytest.importorskip("soxr", reason="needs the extra `speech`")
    short, long = render("Slowing down."), render("Slowing down to sixty kilometres per hour, and keeping this lane.")
    assert short is not None and long is not None
    assert 0.5 < decode(short).duration_s < decode(long).duration_s < 8.0


@needs_espeak
def test_options_phonemes_and_shell_signs_are_only_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for text in ("-w here.wav --version", "$(touch here) `touch here`; touch here", "[[h@'loU]] <voice name='x'>"):
        assert render(text) is not None
    assert list(tmp_path.iterdir()) == []


def test_what_is_said_is_short_and_plain() -> None:
    assert speakable("  Done.\n\u200bNext\x07 [[x]] <b>*now*</b> ") == "Done. Next x b now /b"
    long = "This is a sentence. " * 40
    assert speakable(long).endswith("sentence.") and len(speakable(long)) <= MOST_CHARS
    assert len(speakable("word " * 200)) <= MOST_CHARS and speakable("word " * 200).endswith("word")
    assert len(speakable("a" * 1000)) == MOST_CHARS


@given(st.text(max_size=700))
def test_any_text_is_made_speakable(text: str) -> None:
    found = speakable(text)
    assert len(found) <= MOST_CHARS and not set(found) & set("[]<>{}|\\\n\x00")
    found.encode()


def test_without_the_program_it_is_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    assert not can_speak() and not say("Done.") and render("Done.") is None


def test_words_come_through_the_pipe_and_failure_is_silence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stand_in(tmp_path, f'echo "$@" > {tmp_path}/arguments; cat > {tmp_path}/words', monkeypatch)
    assert say("Keeping 30 m; $HOME -x")
    assert (tmp_path / "words").read_text() == "Keeping 30 m; $HOME -x"
    assert (tmp_path / "arguments").read_text().split() == ["--stdin", "-v", "en-us", "-s", "165"]
    assert not say("  \u200b ")
    stand_in(tmp_path, "exit 3", monkeypatch)
    assert not say("Done.") and render("Done.") is None


def test_a_program_that_hangs_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chauffeur.speech.say._RENDER_S", 0.3)
    stand_in(tmp_path, "exec sleep 30", monkeypatch)
    assert render("Done.") is None
