"""Who may open the page and who may drive: a foreign web page must not, and a broken one must not stop a drive."""

from __future__ import annotations

import asyncio
import builtins
import json
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosedError, InvalidStatus
from wheel_rig import BRAKE, PageClient, SteppedClock, at_the_wheel, connect_page, dataset_of, origin_of, run_of

from chauffeur.concept import ConfigError, DataError, MissingExtraError
from chauffeur.hmi.wheel.protocol import PageMessage, parse
from chauffeur.hmi.wheel.server import NOT_UNDERSTOOD, TAKEN_OVER, WheelServer, serving
from chauffeur.hmi.wheel.session import WheelSession

pytestmark = pytest.mark.server


def _with_server(tmp_path: Path, check: Callable[[PageClient, WheelServer, SteppedClock], Any]) -> None:
    run = run_of(tmp_path / "run", dataset_of(tmp_path / "data", "dec_rel_speed4"))

    async def serve() -> None:
        async with at_the_wheel(run) as (page, server, clock):
            await check(page, server, clock)

    asyncio.run(serve())


def test_the_page_and_its_parts_are_served_to_this_machine_under_the_token(tmp_path: Path) -> None:
    async def check(_page: PageClient, server: WheelServer, _clock: SteppedClock) -> None:
        token = server.url.rstrip("/").rsplit("/", 1)[1]
        assert server.url.startswith("http://127.0.0.1:") and len(token) >= 24
        async with httpx.AsyncClient() as browser:
            for name, kind, word in (
                ("", "text/html", "Chauffeur"),
                ("wheel.js", "text/javascript", "WebSocket"),
                ("draw.js", "text/javascript", "makeRoad"),
                ("wheel.css", "text/css", "--ego-fill"),
            ):
                answer = await browser.get(server.url + name)
                assert answer.status_code == 200 and word in answer.text
                assert answer.headers["content-type"] == f"{kind}; charset=utf-8"
                assert answer.headers["referrer-policy"] == "no-referrer"
                assert answer.headers["x-content-type-options"] == "nosniff"
                policy = answer.headers["content-security-policy"]
                assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy
                assert "unsafe" not in policy and token not in answer.text
            assert (await browser.get(server.url + "../server.py")).status_code == 403
            assert (await browser.get(server.url + "%2e%2e/server.py")).status_code == 404
            assert (await browser.get(server.url + "secret")).status_code == 404

    _with_server(tmp_path, check)


def test_without_token_host_or_origin_nobody_drives(tmp_path: Path) -> None:
    async def refused(server: WheelServer, **changed: Any) -> int:
        with pytest.raises(InvalidStatus) as caught:
            async with connect_page(server, **changed):
                pass
        return caught.value.response.status_code

    async def check(_page: PageClient, server: WheelServer, _clock: SteppedClock) -> None:
        root = origin_of(server)
        async with httpx.AsyncClient() as browser:
            assert (await browser.get(root + "/")).status_code == 403
            assert (await browser.get(root + "/wrong-token/")).status_code == 403
            assert (await browser.get(server.url, headers={"Host": "evil.example"})).status_code == 421
            assert (await browser.get(server.url, headers={"Host": "127.0.0.1:1"})).status_code == 421
        address = root.replace("http", "ws")
        assert await refused(server, address=f"{address}/wrong-token/drive") == 403
        assert await refused(server, origin="http://evil.example") == 403
        assert await refused(server, origin="null") == 403
        assert await refused(server, origin=None) == 403
        assert await refused(server, origin="https" + root.removeprefix("http")) == 403
        async with connect_page(
            server,
            origin=root.replace("127.0.0.1", "localhost"),
            address=server.url.replace("http", "ws").replace("127.0.0.1", "localhost") + "drive",
        ) as socket:
            assert json.loads(await socket.recv())["t"] in ("item", "stage")

    _with_server(tmp_path, check)


def test_a_page_that_talks_nonsense_is_closed_and_the_drive_goes_on(tmp_path: Path) -> None:
    async def check(page: PageClient, server: WheelServer, clock: SteppedClock) -> None:
        await page.start()
        for _ in range(3):
            await page.period(0)
        await page.socket.send('{"t":"keys","k":99,"n":1}')
        with pytest.raises(ConnectionClosedError) as caught:
            while True:
                await page.socket.recv()
        assert caught.value.rcvd is not None and caught.value.rcvd.code == NOT_UNDERSTOOD
        before = page.tick["time"]
        for _ in range(4):  # nobody looks, and yet it drives
            clock.advance()
            await asyncio.sleep(0.02)
        async with connect_page(server) as socket:
            page.socket = socket
            await page.hear(lambda page: page.tick["time"] > before)
            assert page.item and page.stage["stage"] == "driving", "a page that comes later is told everything"
            speed = page.tick["ego"][3]
            for _ in range(3):
                await page.period(BRAKE)
            assert page.tick["ego"][3] < speed

    _with_server(tmp_path, check)


def test_a_second_page_takes_the_wheel_and_the_first_is_told(tmp_path: Path) -> None:
    async def check(page: PageClient, server: WheelServer, _clock: SteppedClock) -> None:
        first = page.socket
        async with connect_page(server) as second:
            page.socket = second
            with pytest.raises(ConnectionClosedError) as caught:
                while True:
                    await first.recv()
            assert caught.value.rcvd is not None and caught.value.rcvd.code == TAKEN_OVER
            await page.start()
            await page.period(0)
            assert page.tick["phase"] == "driving"

    _with_server(tmp_path, check)


def test_an_oversized_message_ends_the_connection(tmp_path: Path) -> None:
    async def check(page: PageClient, _server: WheelServer, _clock: SteppedClock) -> None:
        await page.socket.send("x" * 10_000)
        with pytest.raises(ConnectionClosedError):
            while True:
                await page.socket.recv()

    _with_server(tmp_path, check)


@pytest.mark.parametrize(
    "message",
    [
        *("", "[]", "{}", "null", "[" * 200, b"\xff", '{"t":"fly"}', '{"t":["keys"]}', '{"t":"start","item":7}'),
        *('{"t":"keys","k":true}', '{"t":"keys","k":16}', '{"t":"keys","k":-1}'),
        *('{"t":"keys","k":1,"n":-1}', '{"t":"keys","k":1,"n":1e3}'),
    ],
)
def test_what_is_no_message_is_refused(message: str | bytes) -> None:
    with pytest.raises(DataError):
        parse(message)


def test_what_is_a_message_is_read() -> None:
    assert parse('{"t":"keys","k":5,"n":12}') == PageMessage("keys", parse('{"t":"keys","k":5}').keys, 12)
    assert parse('{"t":"start","item":"left_lc_s0_c0"}').item == "left_lc_s0_c0"


def test_a_taken_port_is_said(tmp_path: Path) -> None:
    run = run_of(tmp_path / "run", dataset_of(tmp_path / "data", "left_lc"))

    async def check() -> None:
        session = WheelSession(run, SteppedClock(), str)
        async with serving(session) as server:
            port = int(origin_of(server).rsplit(":", 1)[1])
            with pytest.raises(ConfigError, match=f"Port {port}"):
                async with serving(session, port):
                    pass

    asyncio.run(check())


def test_a_missing_package_is_said_with_the_command_that_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = run_of(tmp_path / "run", dataset_of(tmp_path / "data", "left_lc"))
    real = builtins.__import__

    def without(name: str, *args: Any, **more: Any) -> Any:
        if name.startswith("websockets"):
            raise ImportError(name)
        return real(name, *args, **more)

    async def check() -> None:
        monkeypatch.setattr(builtins, "__import__", without)
        async with serving(WheelSession(run, SteppedClock(), str)):
            pass

    with pytest.raises(MissingExtraError, match=r"-m pip install .*\[page\]"):
        asyncio.run(check())


@pytest.mark.slow
def test_the_command_serves_drives_keeps_and_goes_on(tmp_path: Path) -> None:
    dataset_of(tmp_path / "data", "left_lc", "dec_rel_speed4")
    command = [sys.executable, "-c", "from chauffeur.cli.main import run; run()", "bench", "human", "--no-open"]
    command += ["--data", str(tmp_path / "data"), "--out", str(tmp_path / "run"), "--as", "ana"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert process.stdout is not None
    lines: list[str] = []
    while not lines or not lines[-1].startswith("http"):
        lines.append(process.stdout.readline())
        assert lines[-1], "".join(lines)
    url = lines[-1].strip()

    async def drive_a_moment() -> None:
        address = url.replace("http", "ws") + "drive"
        async with connect(address, origin=url.rsplit("/", 2)[0]) as socket, asyncio.timeout(60):  # type: ignore[arg-type]
            item, stage, tick = "", "", 0.0
            while tick < 0.5:
                message = json.loads(await socket.recv())
                item = message.get("id", item)
                stage = message.get("stage", stage)
                if message["t"] == "stage" and stage == "ready":
                    await socket.send(json.dumps({"t": "start", "item": item}))
                elif message["t"] == "tick":
                    tick = message["time"]
                    await socket.send(json.dumps({"t": "keys", "k": 0, "n": 1}))

    asyncio.run(drive_a_moment())
    process.send_signal(signal.SIGINT)
    text, _ = process.communicate(timeout=600)
    assert process.returncode == 130, text
    assert "Stopped after 1 of 2 drives" in " ".join(text.split())
    ended = subprocess.run([*command, "--items", "1"], capture_output=True, text=True, timeout=600, check=False)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    (row,) = [json.loads(line) for line in (tmp_path / "run" / "results.jsonl").read_text().splitlines()]
    assert row["outcome"] == "failure" and row["steps"] >= 5 and "Given up" in row["detail"]
    assert "human driver (ana)" in ended.stdout and "results.jsonl" in ended.stdout
