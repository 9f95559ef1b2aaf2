"""A real HTTP server on loopback that answers as services do: rightly, late, never, brokenly."""

from __future__ import annotations

import contextlib
import json
import socket
import socketserver
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest

NOW = 1_700_000_000.0
"""Unix time of the tests: 2023-11-14, 22:13 UTC."""


@dataclass(frozen=True)
class Asked:
    """One request that came in."""

    method: str
    target: str
    headers: dict[str, str]
    body: str

    @property
    def path(self) -> str:
        return urlsplit(self.target).path

    @property
    def query(self) -> dict[str, str]:
        return {name: values[0] for name, values in parse_qs(urlsplit(self.target).query).items()}


def reply(body: bytes | str, status: str = "200 OK", **headers: str) -> bytes:
    """A whole HTTP answer."""
    raw = body.encode() if isinstance(body, str) else body
    lines = [f"HTTP/1.1 {status}", f"Content-Length: {len(raw)}", "Connection: close"]
    lines += [f"{name.replace('_', '-')}: {value}" for name, value in headers.items()]
    return "\r\n".join([*lines, "", ""]).encode() + raw


@dataclass
class Service:
    """A server: `answer` gives the bytes of an answer; None keeps the line open and silent."""

    answer: Callable[[Asked], bytes | None]
    asked: list[Asked] = field(default_factory=list)
    url: str = ""
    drip_s: float = 0.0
    over: threading.Event = field(default_factory=threading.Event)

    def handle(self, line: socket.socket) -> None:
        data = b""
        while b"\r\n\r\n" not in data:
            more = line.recv(65_536)
            if not more:
                return
            data += more
        head, _, body = data.partition(b"\r\n\r\n")
        first, *rest = head.decode("latin-1").split("\r\n")
        headers = {name.lower(): value.strip() for name, _, value in (one.partition(":") for one in rest)}
        while len(body) < int(headers.get("content-length", "0")):
            body += line.recv(65_536)
        method, target, _ = first.split(" ")
        asked = Asked(method, target, headers, body.decode())
        self.asked.append(asked)
        answer = self.answer(asked)
        if answer is None:
            self.over.wait(20.0)
            return
        if self.drip_s:
            for byte in answer:
                line.sendall(bytes([byte]))
                if self.over.wait(self.drip_s):
                    return
        else:
            line.sendall(answer)


@contextlib.contextmanager
def serving(answer: Callable[[Asked], bytes | None], drip_s: float = 0.0) -> Iterator[Service]:
    """A server that runs while the block does."""
    service = Service(answer, drip_s=drip_s)

    class Handler(socketserver.BaseRequestHandler):
        def handle(self) -> None:
            with contextlib.suppress(OSError):
                service.handle(self.request)

    class Server(socketserver.ThreadingTCPServer):
        allow_reuse_address = True
        daemon_threads = True
        block_on_close = False

    with Server(("127.0.0.1", 0), Handler) as server:
        service.url = f"http://127.0.0.1:{server.server_address[1]}"
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        try:
            yield service
        finally:
            service.over.set()
            server.shutdown()


def weather_json(**changed: Any) -> str:
    """An answer of OpenWeather 2.5, in its form; every number is made up."""
    return json.dumps({
        "coord": {"lon": 11.575, "lat": 48.137},
        "weather": [{"id": 500, "main": "Rain", "description": "light rain", "icon": "10n"}],
        "base": "stations",
        "main": {"temp": 6.8, "feels_like": 4.1, "temp_min": 6.0, "temp_max": 7.5, "pressure": 1008, "humidity": 93},
        "visibility": 4000,
        "wind": {"speed": 4.1, "deg": 250, "gust": 9.6},
        "rain": {"1h": 0.8},
        "clouds": {"all": 100},
        "dt": NOW - 30.0,
        "sys": {"country": "DE", "sunrise": NOW - 54_000.0, "sunset": NOW - 22_000.0},
        "timezone": 3600,
        "name": "Munich",
        "cod": 200,
        **changed,
    })  # fmt: skip


def traffic_json(line: list[tuple[float, float]], **changed: Any) -> str:
    """An answer of TomTom's flow segment data, in its form; every number is made up."""
    return json.dumps({
        "flowSegmentData": {
            "frc": "FRC2",
            "currentSpeed": 31,
            "freeFlowSpeed": 72,
            "currentTravelTime": 180,
            "freeFlowTravelTime": 77,
            "confidence": 0.9,
            "roadClosure": False,
            "coordinates": {"coordinate": [{"latitude": lat, "longitude": lon} for lat, lon in line]},
            "@version": "traffic-service 4",
            **changed,
        }
    })  # fmt: skip


def roads_json(*ways: tuple[int, dict[str, str], list[tuple[float, float]]], **changed: Any) -> str:
    """An answer of Overpass to `out tags geom`, in its form."""
    return json.dumps({
        "version": 0.6,
        "generator": "Overpass API 0.7.62",
        "osm3s": {"timestamp_osm_base": "2023-11-14T20:00:00Z", "copyright": "The data is from OpenStreetMap"},
        "elements": [
            {
                "type": "way",
                "id": number,
                "bounds": {"minlat": 0.0, "minlon": 0.0, "maxlat": 0.0, "maxlon": 0.0},
                "geometry": [{"lat": lat, "lon": lon} for lat, lon in line],
                "tags": tags,
            }
            for number, tags, line in ways
        ],
        **changed,
    })  # fmt: skip


@pytest.mark.server
def test_the_server_speaks_http_and_can_hold_its_tongue() -> None:
    import httpx

    with serving(lambda asked: reply(asked.query["word"]) if asked.path == "/say" else None) as service:
        assert httpx.get(f"{service.url}/say", params={"word": "fine"}, trust_env=False).text == "fine"
        began = time.monotonic()
        with pytest.raises(httpx.ReadTimeout):
            httpx.get(f"{service.url}/silence", timeout=0.1, trust_env=False)
        assert time.monotonic() - began < 5.0
    assert [one.path for one in service.asked] == ["/say", "/silence"]
