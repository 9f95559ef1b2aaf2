"""The file of context sources, a receiver behind gpsd, and lines of C that say who told them."""

from __future__ import annotations

import asyncio
import json
import socket
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_services_map import write_file
from test_services_server import Asked, reply, serving, weather_json

from chauffeur.concept import ConfigError, Context, DataError, Situation
from chauffeur.describe.services import gps
from chauffeur.describe.services.gps import Gpsd, read_fix
from chauffeur.describe.services.readings import Position, Unknown
from chauffeur.describe.services.sourced import told, with_sources
from chauffeur.describe.services.sources import Sources, read_sources
from chauffeur.describe.services.surroundings import Surroundings

FIX = {"class": "TPV", "mode": 3, "lat": 48.0, "lon": 11.0, "track": 2.0, "speed": 14.0, "eph": 4.0}
SITUATION = Situation("vehicle", 0.0, 10.0, 1, 0, False, None, None)


def write(folder: Path, text: str) -> Path:
    path = folder / "services.toml"
    path.write_text(text)
    return path


def look(path: Path, **keys: str) -> tuple[Surroundings | Unknown, str]:
    async def whole() -> tuple[Surroundings | Unknown, str]:
        async with Sources(read_sources(path), environ=keys) as sources:
            return await sources.look(), sources.place_words()

    return asyncio.run(whole())


def test_map_and_rules_with_their_sources(tmp_path: Path) -> None:
    write_file(tmp_path / "town.osm.pbf")
    path = write(
        tmp_path, 'region = "germany"\nmap = "town.osm.pbf"\n[position]\nat = [48.0, 11.0]\nheading_deg = 2.0\n'
    )
    found, words = look(path)
    context = with_sources(Context("I drive.", SITUATION), found, words)
    assert context.text.startswith("I drive. Place: as it stands in services.toml; it is not measured")
    assert "Speed limit: 120 km/h (33.3 m/s). (Source: OpenStreetMap file town.osm.pbf, " in context.text
    assert "Weather: not known (no such service is switched on). Road:" in context.text
    assert "(Source: rules of Germany, " in context.text
    assert all(value in context.text for _, value in context.situation.scene)
    assert [name for name, _ in context.situation.scene][:2] == ["place", "weather"]
    assert "48.0" not in context.text  # the place itself stays here


@pytest.mark.server
def test_a_service_that_answers_and_one_that_hangs(tmp_path: Path) -> None:
    def answer(asked: Asked) -> bytes | None:
        return reply(weather_json(dt=None)) if asked.path == "/data/2.5/weather" else None

    with serving(answer) as service:
        text = f"""online = ["weather", "traffic"]
budget_s = 1.0
[position]
at = [48.1, 11.5]
[urls]
weather = "{service.url}"
traffic = "{service.url}"
"""
        found, _ = look(write(tmp_path, text), OPENWEATHER_API_KEY="k1", TOMTOM_API_KEY="k2")
    lines = dict(told(found))
    assert lines["weather"].startswith("Weather: light rain")
    assert "(Source: OpenWeather, " in lines["weather"]
    assert lines["traffic"] == "Traffic: not known (the service did not answer within 1 s)."


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "position"),
        ("[position]\n", "give either at"),
        ('[position]\nat = [1.0, 2.0]\ngpsd = "localhost"\n', "give either at"),
        ('[position]\ngpsd = "localhost:0"\n', "has no port"),
        ('[position]\ngpsd = "localhost"\nheading_deg = 3.0\n', "gpsd measures its own"),
        ('[position]\ngpsd = "http://localhost"\n', "position.gpsd"),
        ("[position]\nat = [95.0, 2.0]\n", "not a position"),
        ("[position]\nat = [nan, 2.0]\n", "finite"),
        ('region = "atlantis"\n[position]\nat = [1.0, 2.0]\n', "no traffic rules"),
        ('map = "absent.osm.pbf"\n[position]\nat = [1.0, 2.0]\n', "cannot be read"),
        ('online = ["astrology"]\n[position]\nat = [1.0, 2.0]\n', "online"),
        ("budget_s = 100.0\n[position]\nat = [1.0, 2.0]\n", "budget_s"),
        ("colour = 3\n[position]\nat = [1.0, 2.0]\n", "colour"),
        ("= 3", "not TOML"),
    ],
)
def test_files_that_cannot_be_used(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises((ConfigError, DataError), match=said):
        read_sources(write(tmp_path, text))


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read"):
        read_sources(tmp_path / "none.toml")


@dataclass
class Daemon:
    """Speaks as gpsd does: a greeting, the answer to ?WATCH, then what a test gives it, to everybody."""

    port: int = 0
    asked: list[bytes] = field(default_factory=list)
    lines: list[bytes] = field(default_factory=list)
    connections: list[socket.socket] = field(default_factory=list)

    def serve(self, listener: socket.socket) -> None:
        while True:
            try:
                sock, _ = listener.accept()
            except OSError:
                return
            self.connections.append(sock)
            with sock.makefile("rb") as reader:
                sock.sendall(b'{"class":"VERSION","release":"3.25","proto_major":3,"proto_minor":15}\r\n')
                self.asked.append(reader.readline())
                sock.sendall(b'{"class":"DEVICES","devices":[]}\r\n{"class":"WATCH","enable":true,"json":true}\r\n')
                sock.sendall(b"".join(self.lines))

    def tell(self, report: Any) -> None:
        self.connections[-1].sendall(json.dumps(report).encode() + b"\r\n")


@contextmanager
def gpsd(*lines: bytes) -> Iterator[Daemon]:
    listener = socket.create_server(("127.0.0.1", 0))
    daemon = Daemon(listener.getsockname()[1], lines=list(lines))
    thread = threading.Thread(target=daemon.serve, args=(listener,), daemon=True)
    thread.start()
    try:
        yield daemon
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        for sock in daemon.connections:
            sock.close()


def follow(daemon: Daemon, steps: Callable[[Gpsd, list[float]], Awaitable[None]]) -> None:
    now = [100.0]

    async def whole() -> None:
        receiver = Gpsd("127.0.0.1", daemon.port, clock=lambda: now[0])
        try:
            await steps(receiver, now)
        finally:
            await receiver.close()

    asyncio.run(whole())


async def until(true: Callable[[], Any]) -> None:
    for _ in range(1000):
        if true():
            return
        await asyncio.sleep(0.005)
    raise AssertionError("it never came")


@pytest.mark.server
def test_a_receiver_tells_where_the_car_is_and_how_old_that_is(tmp_path: Path) -> None:
    async def steps(receiver: Gpsd, now: list[float]) -> None:
        first = receiver.position()
        assert isinstance(first, Unknown)
        assert "has not answered yet" in first.reason
        await until(lambda: isinstance(receiver.position(), Position))
        assert receiver.position() == Position(48.0, 11.0, 2.0, 4.0)
        assert receiver.words() == "Place: measured 0.0 s ago, within about 4 m. (Source: gpsd.)"
        now[0] += 2.0
        assert "measured 2.0 s ago" in receiver.words()
        now[0] += 2.0
        old = receiver.position()
        assert isinstance(old, Unknown)
        assert "the last fix is 4 s old" in old.reason
        assert receiver.words() == ""
        daemon.tell({"class": "TPV", "mode": 1})  # no fix any more
        daemon.tell({"class": "SKY"})
        daemon.tell(FIX | {"speed": 0.2})
        await until(lambda: isinstance(receiver.position(), Position))
        assert receiver.position() == Position(48.0, 11.0, None, 4.0)  # a heading at a stand is noise

    with gpsd(json.dumps(FIX).encode() + b"\r\n") as daemon:
        follow(daemon, steps)
    assert daemon.asked == [b'?WATCH={"enable":true,"json":true};\n']


@pytest.mark.server
@pytest.mark.parametrize("rubbish", [b"x" * 100_000, b"not json\r\n", b"[" * 30_000 + b"\r\n", b"[]\r\n" + b"\xff\r\n"])
def test_a_receiver_that_sends_rubbish_or_ends(rubbish: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gps, "RETRY_S", 0.01)

    async def steps(receiver: Gpsd, now: list[float]) -> None:
        await until(lambda: len(daemon.connections) > 1)
        found = receiver.position()
        assert isinstance(found, Unknown)
        assert "cannot be read" in found.reason
        daemon.lines[:] = [json.dumps(FIX).encode() + b"\n"]
        await until(lambda: isinstance(receiver.position(), Position))

    with gpsd(rubbish) as daemon:
        follow(daemon, steps)


@pytest.mark.server
def test_no_receiver_means_no_place_and_the_reason(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]

    async def whole() -> str:
        path = write(tmp_path, f'[position]\ngpsd = "127.0.0.1:{port}"\n')
        async with Sources(read_sources(path)) as sources:
            await asyncio.sleep(0.05)
            found = await sources.look()
            return with_sources(Context("I drive.", SITUATION), found, sources.place_words()).text

    text = asyncio.run(whole())
    assert text.startswith("I drive. Weather, road, speed limit and traffic: not known (gpsd at 127.0.0.1:")


PLAIN = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)
NAMES = st.sampled_from(["lat", "lon", "mode", "track", "speed", "eph"])


@given(st.dictionaries(NAMES, PLAIN | st.lists(PLAIN, max_size=2)))
def test_any_report_is_a_place_or_none(report: dict[str, Any]) -> None:
    found = read_fix({"mode": 3, **report})
    assert found is None or isinstance(found, Position)
