"""Who may open the cabin page, who has the wheel, what a late, slow or broken screen is told: with real clients."""

from __future__ import annotations

import asyncio
import json
import ssl
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosedError, InvalidStatus

from chauffeur.concept import ConfigError
from chauffeur.driving.talk.messages import (
    Answered,
    Button,
    Conversation,
    Ended,
    HeardWords,
    HowWasIt,
    Note,
    Road,
    RoadLane,
    Say,
    Scene,
    SessionState,
    ShownBody,
    Stop,
)
from chauffeur.hmi import local_page
from chauffeur.hmi.cabin import Cabin, Certificate
from chauffeur.hmi.cabin.board import MOST_WAITING, LatestMessages, Outbox
from chauffeur.hmi.cabin.room import NOT_UNDERSTOOD
from chauffeur.hmi.cabin.server import MOST_SOUND_BYTES
from chauffeur.hmi.local_page import MOST_AT_THE_DOOR

pytestmark = pytest.mark.server

SESSION = SessionState("cruise", "A road", 3, "meaning", "grammar/test", False, "ada", "simulated", 0.1, ("a limit",))
ROAD = Road(
    "highway",
    tuple(RoadLane(f"0-1:{i}", 4.0, "0-1", i, i == 2, ((0.0, 4.0 * i), (500.0, 4.0 * i))) for i in range(3)),
)
EGO = ShownBody(0, "car", 10.0, 4.0, 0.0, 5.0, 2.0, 25.0)
ASKED = HeardWords("heard", "change to the left lane", "command", "grammar/test", 0.6, True, "", 1.0)


def scene(time_s: float) -> Scene:
    return Scene(time_s, EGO, (), 0.0, 0.0, 30.0, 25.0, 1.5, None, None, "follow", "", None, "", False, 0)


def test_the_car_speaks_in_the_unit_of_the_person_and_whole() -> None:
    board = LatestMessages()

    def told(text: str, why: str) -> dict[str, Any]:
        return json.loads(board.write(Conversation("w1", text, why=why, thoughts=why))[0])

    first = told("Slower.", "I drive 13.4 m/s (30 mph, 48 km/h).")
    assert (first["unit"], first["why"]) == ("km/h", "I drive 48 km/h.")
    second = told("Drive at 80 mph.", "A target speed of 129 km/h is too fast.")
    assert (second["unit"], second["thoughts"]) == ("mph", "A target speed of 80 mph is too fast.")
    assert told("A bit slower.", "I drive 20.0 m/s.")["why"] == "I drive 45 mph.", "until another unit is named"
    assert json.loads(board.write(Note("Now 100 km/h."))[0])["text"] == "Now 62 mph."


@pytest.fixture
def cabin() -> Iterator[Cabin]:
    with Cabin() as cabin:
        yield cabin


def origin_of(cabin: Cabin) -> str:
    return cabin.url.rsplit("/", 2)[0]


def screen_of(cabin: Cabin, **changed: Any) -> Any:
    """A WebSocket as the page opens it, but for what is changed."""
    address = changed.pop("address", cabin.url.replace("http", "ws", 1) + "talk")
    return connect(address, **({"origin": origin_of(cabin)} | changed))


async def hear(socket: ClientConnection, kind: str, **fields: Any) -> dict[str, Any]:
    """The next message of a kind in which these fields are so."""
    async with asyncio.timeout(20):
        while True:
            message = json.loads(await socket.recv())
            if message["kind"] == kind and all(message[name] == value for name, value in fields.items()):
                return message


async def told(cabin: Cabin) -> Any:
    """What the session is told next; the browser goes on meanwhile."""
    return await asyncio.to_thread(cabin.take, 20.0)


def run(check: Callable[[], Any]) -> None:
    asyncio.run(check())


def test_the_page_and_its_parts_are_served_to_this_machine_under_the_token(cabin: Cabin) -> None:
    async def check() -> None:
        token = cabin.url.rstrip("/").rsplit("/", 1)[1]
        assert cabin.url.startswith("http://127.0.0.1:") and len(token) >= 24
        async with httpx.AsyncClient() as browser:
            page = (await browser.get(cabin.url)).text
            parts = {"cabin.css": "text/css", "cabin.js": "text/javascript"}
            for name in ("conversation", "elements", "hands", "link", "memory", "microphone"):
                parts[f"{name}.js"] = "text/javascript"
            for name in ("recorder", "resample", "scene", "words"):
                parts[f"{name}.js"] = "text/javascript"
            for name, kind in ({"": "text/html"} | parts).items():
                answer = await browser.get(cabin.url + name)
                assert answer.status_code == 200 and answer.headers["content-type"] == f"{kind}; charset=utf-8"
                assert "http://" not in answer.text.replace("http://www.w3.org", "") and "https://" not in answer.text
                assert answer.headers["permissions-policy"].endswith("microphone=(self)")
                policy = answer.headers["content-security-policy"]
                assert "default-src 'none'" in policy and "unsafe" not in policy and token not in answer.text
            assert 'src="cabin.js"' in page and "style=" not in page and "onclick" not in page
            assert (await browser.get(cabin.url + "../server.py")).status_code == 403
            assert (await browser.get(cabin.url + "secret")).status_code == 404
            assert (await browser.get(cabin.url, headers={"Host": "evil.example"})).status_code == 421
            assert (await browser.get(origin_of(cabin) + "/wrong-token/")).status_code == 403

    run(check)


@pytest.mark.parametrize("origin", ["http://evil.example", "null", None, "https://127.0.0.1"])
def test_a_foreign_page_hears_and_says_nothing(cabin: Cabin, origin: Any) -> None:
    async def check() -> None:
        with pytest.raises(InvalidStatus) as caught:
            async with screen_of(cabin, origin=origin):
                pass
        assert caught.value.response.status_code == 403

    run(check)


def test_a_late_screen_gets_everything_that_still_holds(cabin: Cabin) -> None:
    cabin.tell(SESSION)
    cabin.tell(ROAD)
    for time_s in (0.1, 0.2, 0.3):
        cabin.tell(scene(time_s))
    first = Conversation("w1", "Drive faster.")
    for one in (first, replace(first, stage="driven"), Conversation("w2", "Slower.", spoken=True)):
        cabin.tell(one)
    cabin.tell(Note("long ago"))
    cabin.tell(HowWasIt("w1", "Drive faster."))
    cabin.tell(ASKED)

    async def check() -> None:
        async with screen_of(cabin) as screen:
            messages = [json.loads(await screen.recv()) for _ in range(8)]
            kinds = [message["kind"] for message in messages]
            assert kinds[:3] == ["session", "road", "scene"] and kinds[-1] == "place"
            assert kinds[3:5] == ["conversation"] * 2 and set(kinds[5:7]) == {"how_was_it", "heard"}
            assert messages[2]["time_s"] == 0.3 and messages[3]["stage"] == "driven"
            road = messages[1]
            assert [lane["i"] for lane in road["lanes"]] == [0, 1, 2]
            assert {line["s"] for line in road["lines"]} == {"solid", "dashed"}
            assert [surface["k"] for surface in road["surfaces"]] == ["emergency", "driving", "driving"], (
                "bottom to top"
            )
            cabin.tell(Answered("heard"))
            cabin.tell(Answered("how_was_it"))
            await hear(screen, "answered", question="how_was_it")
        async with screen_of(cabin) as later:
            assert [json.loads(await later.recv())["kind"] for _ in range(6)][3:] == ["conversation"] * 2 + ["place"]

    run(check)


def test_what_a_person_does_reaches_the_session_in_order(cabin: Cabin) -> None:
    async def check() -> None:
        async with screen_of(cabin) as screen:
            await screen.send('{"kind":"button","button":"command","held":true}')
            await screen.send(b"\x01\x00" * 1600)
            await screen.send('{"kind":"button","button":"command","held":false}')
            await screen.send('{"kind":"say","text":"Überhole, bitte."}')
            assert await told(cabin) == Button("command", held=True)
            assert await told(cabin) == b"\x01\x00" * 1600
            assert [await told(cabin), await told(cabin)] == [Button("command", held=False), Say("Überhole, bitte.")]
            assert cabin.take() is None

    run(check)


def test_one_screen_has_the_wheel_and_any_may_stop_the_car(cabin: Cabin) -> None:
    async def check() -> None:
        async with screen_of(cabin) as first, screen_of(cabin) as second:
            assert (await hear(first, "place", screens=2))["wheel"] == "mine"
            assert (await hear(second, "place", screens=2))["wheel"] == "taken"
            await second.send('{"kind":"say","text":"from the back seat"}')
            await second.send(b"\0\0")
            await second.send('{"kind":"stop"}')
            assert await told(cabin) == Stop(), "and nothing of what came before it"
            await first.send('{"kind":"button","button":"command","held":true}')
            assert await told(cabin) == Button("command", held=True)
            await second.send('{"kind":"wheel"}')
            assert await told(cabin) == Button("command", held=False), (
                "nobody holds a button on a screen without the wheel"
            )
            await hear(first, "place", wheel="taken")
            await second.send('{"kind":"say","text":"mine now"}')
            assert await told(cabin) == Say("mine now")

    run(check)


def test_a_screen_that_vanishes_lets_go_of_its_button_and_gets_the_wheel_back(cabin: Cabin) -> None:
    async def check() -> None:
        async with screen_of(cabin) as watching:
            await watching.send('{"kind":"wheel"}')
            driving = await screen_of(cabin)
            await driving.send('{"kind":"wheel"}')
            await hear(watching, "place", wheel="taken")
            await driving.send('{"kind":"button","button":"evaluate","held":true}')
            assert await told(cabin) == Button("evaluate", held=True)
            driving.transport.abort()
            assert await told(cabin) == Button("evaluate", held=False)
            assert cabin.take() is None, "and nothing else: the drive goes on"
            await hear(watching, "place", wheel="free")
            async with screen_of(cabin) as again:
                await hear(again, "place", wheel="mine")

    run(check)


@pytest.mark.parametrize(
    "message",
    ["", "[]", '{"kind":"fly"}', '{"kind":"say"}', '{"kind":"say","text":"' + "x" * 2001 + '"}', "[" * 500, b"\0\0\0"],
)
def test_a_page_that_talks_nonsense_is_closed_and_nothing_reaches_the_session(cabin: Cabin, message: Any) -> None:
    async def check() -> None:
        async with screen_of(cabin) as screen:
            await screen.send(message)
            with pytest.raises(ConnectionClosedError) as caught:
                while True:
                    await screen.recv()
            assert caught.value.rcvd is not None and caught.value.rcvd.code == NOT_UNDERSTOOD
        async with screen_of(cabin) as screen:
            await screen.send('{"kind":"stop"}')
            assert await told(cabin) == Stop()

    run(check)


def test_an_oversized_message_ends_the_connection(cabin: Cabin) -> None:
    async def check() -> None:
        async with screen_of(cabin) as screen:
            await screen.send(b"\0" * (1 << 17))
            with pytest.raises(ConnectionClosedError):
                while True:
                    await screen.recv()
        assert cabin.take() is None

    run(check)


def test_sound_that_nobody_takes_is_dropped_and_that_is_said_once(cabin: Cabin) -> None:
    async def check() -> None:
        async with screen_of(cabin) as screen:
            for _ in range(MOST_SOUND_BYTES // 32_000 + 3):
                await screen.send(b"\0" * 32_000)
            await screen.send('{"kind":"say","text":"words are kept"}')
            await screen.send('{"kind":"stop"}')
            assert "lost" in (await hear(screen, "note"))["text"]
            await screen.send('{"kind":"wheel"}')
            await hear(screen, "place")  # everything has arrived
            sound = 0
            while isinstance(one := (await told(cabin)), bytes):
                sound += len(one)
            assert sound == MOST_SOUND_BYTES
            assert (one, await told(cabin)) == (Say("words are kept"), Stop())
            await screen.send(b"\0" * 320)
            assert await told(cabin) == b"\0" * 320, "and later sound is heard again"

    run(check)


def test_a_slow_screen_misses_scenes_and_nothing_that_matters() -> None:
    async def check() -> None:
        board, outbox = LatestMessages(), Outbox({})
        for number in range(400):
            text, key = board.write(scene(number / 10))
            outbox.put(text, key)
            if number % 4 == 0:
                outbox.put(*board.write(Note(f"note {number}")))
                outbox.put(*board.write(Conversation("w1", "Faster.", why=str(number))))
        got = []
        async for text in outbox.follow():
            got.append(json.loads(text))
            if len(got) == 102:
                break
        kinds = [message["kind"] for message in got]
        assert kinds.count("scene") == 1 and kinds.count("conversation") == 1 and kinds.count("note") == 100
        assert kinds[-2:] == ["conversation", "scene"], "the newest comes after what was said before it"
        assert next(m for m in got if m["kind"] == "scene")["time_s"] == 39.9
        assert next(m for m in got if m["kind"] == "conversation")["why"] == "396"

    run(check)


def test_a_screen_that_does_not_read_is_let_go_and_holds_up_nobody(cabin: Cabin) -> None:
    async def check() -> None:
        async with screen_of(cabin, max_queue=1) as deaf, screen_of(cabin) as awake:
            await hear(awake, "place", screens=2)
            deaf.transport.pause_reading()
            for number in range(MOST_WAITING * 3):
                text = f"{number} " + "x" * 20_000
                cabin.tell(Note(text))
                if number % 100 == 99:
                    await hear(awake, "note", text=text)
            await awake.send('{"kind":"wheel"}')
            await hear(awake, "place", wheel="mine", screens=1)
            deaf.transport.resume_reading()
            with pytest.raises(ConnectionClosedError):
                while True:
                    await deaf.recv()

    run(check)


def test_a_screen_that_does_not_read_does_not_hold_up_the_end() -> None:
    async def check() -> None:
        with Cabin() as cabin:
            deaf = await screen_of(cabin, max_queue=1)
            deaf.transport.pause_reading()
            for number in range(MOST_WAITING - 10):
                cabin.tell(Note(f"{number} " + "x" * 50_000))
            ending = threading.Thread(target=cabin.__exit__, args=(None, None, None))
            ending.start()
            await asyncio.to_thread(ending.join, 15.0)
            assert not ending.is_alive()
            deaf.transport.abort()

    run(check)


def test_telling_never_waits_and_after_the_end_nothing_happens() -> None:
    with Cabin() as cabin:
        url = cabin.url
        assert threading.active_count() > 1
    cabin.tell(Note("too late"))
    assert cabin.take() is None
    with pytest.raises(httpx.ConnectError):
        httpx.get(url)


def test_the_last_words_reach_the_screens() -> None:
    async def check() -> None:
        cabin = Cabin()
        with cabin:
            screen = await screen_of(cabin)
            cabin.tell(Ended("ended", "The drive has ended."))
            closing = threading.Thread(target=cabin.__exit__, args=(None, None, None))
            closing.start()
            assert (await hear(screen, "ended"))["text"] == "The drive has ended."
            await screen.wait_closed()
            await asyncio.to_thread(closing.join)

    run(check)


def test_a_taken_port_is_said(cabin: Cabin) -> None:
    port = int(origin_of(cabin).rsplit(":", 1)[1])
    with pytest.raises(ConfigError, match=f"Port {port}"), Cabin(port=port):
        pass


def test_other_machines_are_let_in_only_encrypted(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="without encryption"):
        Cabin(host="192.168.7.1")
    with pytest.raises(ConfigError, match="one name"):
        Cabin(host="0.0.0.0")
    with pytest.raises(ConfigError, match="no certificate"):
        Cabin(host="192.168.7.1", certificate=Certificate(tmp_path / "no.pem", tmp_path / "no.key"))
    pair = Certificate(tmp_path / "cabin.pem", tmp_path / "cabin.key")
    command = "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=localhost"
    names = ["-addext", "subjectAltName=DNS:localhost", "-keyout", str(pair.key), "-out", str(pair.chain)]
    try:
        subprocess.run([*command.split(), *names], check=True, capture_output=True, timeout=600)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no openssl here to make a certificate with")

    async def check(cabin: Cabin) -> None:
        trusted = ssl.create_default_context(cafile=pair.chain)
        async with httpx.AsyncClient(verify=trusted) as browser:
            assert (await browser.get(cabin.url)).status_code == 200
        async with screen_of(cabin, ssl=trusted) as screen:
            await screen.send('{"kind":"stop"}')
            assert await told(cabin) == Stop()

    with Cabin(host="localhost", certificate=pair) as cabin:
        assert cabin.url.startswith("https://localhost:")
        asyncio.run(check(cabin))


def test_telling_is_quick_even_of_a_long_road(cabin: Cabin) -> None:
    """Whoever tells only hands over; the page's own thread draws."""
    lanes = tuple(RoadLane(f"0-1:{i}", 4.0, "0-1", i, False, ((0.0, 4.0 * i), (10_000.0, 4.0 * i))) for i in range(8))
    drawing = threading.Event()
    began = time.perf_counter()
    cabin.tell(Road("highway", lanes))
    handed_over = time.perf_counter() - began

    async def check() -> None:
        async with screen_of(cabin) as screen:
            assert len((await hear(screen, "road"))["lanes"]) == 8
            drawing.set()

    run(check)
    assert drawing.is_set() and handed_over < time.perf_counter() - began


def open_files() -> int:
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


def test_a_crowd_at_the_door_takes_nothing_from_the_drive_and_keeps_nobody_out(
    monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(local_page, "AT_THE_DOOR_S", 1.0)
    cabin = request.getfixturevalue("cabin")
    own = open_files()
    where = urlsplit(cabin.url)
    port = where.port
    crowd = subprocess.Popen(
        [sys.executable, "-c", CROWD, str(port)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        assert crowd.stdout is not None and crowd.stdin is not None
        assert crowd.stdout.readline() == "100 came\n"
        until = time.monotonic() + 20.0
        while (taken := open_files() - own) > MOST_AT_THE_DOOR + 16:
            assert time.monotonic() < until, f"{taken} descriptors are taken"
            time.sleep(0.01)
        assert httpx.get(cabin.url).status_code == 200

        async def look() -> None:
            async with screen_of(cabin) as socket:
                await hear(socket, "place")

        asyncio.run(look())
        assert not [record for record in caplog.records if record.name == "asyncio"]
        gone = int(crowd.communicate("\n", timeout=600)[0])  # all of them, once the time at the door is over
        assert gone == 100
    finally:
        crowd.kill()
        crowd.wait()


CROWD = """
import resource, select, socket, sys, time
resource.setrlimit(resource.RLIMIT_NOFILE, (1024, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
came = [socket.create_connection(("127.0.0.1", int(sys.argv[1])), 20) for _ in range(100)]
print(len(came), "came", flush=True)
input()
gone, until = 0, time.monotonic() + 40
for one in came:
    one.settimeout(max(0.1, until - time.monotonic()))
    try:
        gone += one.recv(100) == b"" or 1
    except TimeoutError:
        pass
    except OSError:
        gone += 1
print(gone)
"""
