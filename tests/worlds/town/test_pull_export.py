"""Fetching public towns over loopback, and exporting one from what looks like a CARLA server."""

from __future__ import annotations

import hashlib
import json
import math
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import SimpleNamespace

import pytest

from chauffeur.concept import DataError
from chauffeur.worlds.town import pull as pulling
from chauffeur.worlds.town.export import export
from chauffeur.worlds.town.pull import PublicFile, pull


class _Mirror(ThreadingHTTPServer):
    """Serves some files and counts what it is asked."""

    def __init__(self, files: dict[str, bytes]) -> None:
        self.asked: list[str] = []

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                server = self.server
                assert isinstance(server, _Mirror)
                server.asked.append(self.path)
                content = files.get(self.path.lstrip("/"))
                self.send_response(404 if content is None else 200)
                self.send_header("Content-Length", str(len(content or b"")))
                self.end_headers()
                self.wfile.write(content or b"")

            def log_message(self, format: str, *args: object) -> None:
                pass

        super().__init__(("127.0.0.1", 0), Handler)


@pytest.fixture
def mirror(monkeypatch: pytest.MonkeyPatch) -> Iterator[_Mirror]:
    files = {"a/Mini.xodr": b"<OpenDRIVE/>", "a/table.json": b"[]", "a/other.json": b"{}"}
    good = hashlib.sha256(b"[]").hexdigest()
    xodr = PublicFile("a/Mini.xodr", "Mini.xodr", hashlib.sha256(b"<OpenDRIVE/>").hexdigest())
    monkeypatch.setattr(
        pulling,
        "PUBLIC",
        {
            "Mini": (xodr, PublicFile("a/table.json", "table.json", good)),
            "Swapped": (xodr, PublicFile("a/other.json", "other.json", good)),
            "Gone": (PublicFile("a/gone.xodr", "gone.xodr", good),),
        },
    )
    with _Mirror(files) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield server
        server.shutdown()
        thread.join(10.0)


@pytest.mark.server
def test_a_town_is_fetched_once_and_checked(mirror: _Mirror, tmp_path: Path) -> None:
    host = f"http://127.0.0.1:{mirror.server_port}"
    assert pull("Mini", tmp_path, host=host) == tmp_path / "Mini.xodr"
    assert (tmp_path / "table.json").read_bytes() == b"[]"
    assert pull("Mini", tmp_path, host=host) == tmp_path / "Mini.xodr"
    assert mirror.asked == ["/a/Mini.xodr", "/a/table.json"]
    with pytest.raises(DataError, match="another file"):
        pull("Swapped", tmp_path, host=host)
    assert not (tmp_path / "other.json").exists()
    with pytest.raises(DataError, match="404"):
        pull("Gone", tmp_path, host=host)
    with pytest.raises(DataError, match="Mini"):
        pull("Atlantis", tmp_path, host=host)


@pytest.mark.server
def test_no_server_is_said(tmp_path: Path, mirror: _Mirror) -> None:
    with pytest.raises(DataError, match="Cannot fetch") as said:
        pull("Mini", tmp_path, host="http://127.0.0.1:9")
    assert said.value.retryable


class _Actors(list):  # type: ignore[type-arg]
    def filter(self, pattern: str) -> list[object]:
        return [one for one in self if one.type_id.startswith(pattern.rstrip("*"))]


def test_a_servers_town_becomes_tables(tmp_path: Path) -> None:
    """Values are CARLA's own classes; the actors are stand-ins that answer what real ones answer."""
    carla = pytest.importorskip("carla")

    def light(number: int, x: float) -> SimpleNamespace:
        yaw = carla.Rotation(yaw=90.0)
        stops = [
            SimpleNamespace(transform=carla.Transform(carla.Location(x + aside, 20.0, 0.0), yaw), lane_width=3.5)
            for aside in (0.0, -3.5)
        ]
        return SimpleNamespace(
            id=number,
            type_id="traffic.traffic_light",
            get_stop_waypoints=lambda: stops,
            get_group_traffic_lights=lambda: lights,
            get_green_time=lambda: 10.0,
            get_yellow_time=lambda: 3.0,
            get_red_time=lambda: 2.0,
        )

    lights = [light(7, 5.0), light(8, 50.0)]
    box = carla.BoundingBox(carla.Location(1.0, 0.0, 0.0), carla.Vector3D(1.5, 2.0, 1.0))
    stop = SimpleNamespace(
        id=9,
        type_id="traffic.stop",
        trigger_volume=box,
        get_transform=lambda: carla.Transform(carla.Location(100.0, 0.0, 0.0), carla.Rotation(yaw=180.0)),
    )
    world = SimpleNamespace(
        get_map=lambda: SimpleNamespace(name="Carla/Maps/TownX", to_opendrive=lambda: "<OpenDRIVE/>"),
        get_actors=lambda: _Actors([*lights, stop]),
    )
    sources = export(world, tmp_path)
    assert sources.xodr == tmp_path / "TownX.xodr"
    assert sources.stop_lines is not None
    assert sources.cycles is not None
    rows = {row["actor_id"]: row for row in json.loads(sources.stop_lines.read_text())}
    assert (rows[7]["x"], rows[7]["y"], rows[7]["width"]) == pytest.approx((3.25, 20.0, 7.0), abs=1e-3)
    assert rows[7]["orientation"] == pytest.approx(math.pi / 2)
    assert (rows[9]["agent_type"], rows[9]["x"]) == ("stop_sign", pytest.approx(99.0, abs=1e-3))
    (cycle,) = json.loads(sources.cycles.read_text())
    assert [(p["duration"], p["actor_states"]["7"][0] + p["actor_states"]["8"][0]) for p in cycle] == [
        (10.0, "gr"), (3.0, "yr"), (2.0, "rr"), (10.0, "rg"), (3.0, "ry"), (2.0, "rr"),
    ]  # fmt: skip
