"""Who may open the viewer, what it answers of real runs, what it says of running and foreign ones, what it exports."""

from __future__ import annotations

import asyncio
import base64
import fcntl
import gzip
import hashlib
import json
import os
import re
import signal
import subprocess
import sys
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import httpx
import pytest
from sample_trips import HOSTILE
from typer.testing import CliRunner
from viewer_folders import content_of, ids_of, make_folders
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from chauffeur.bench.viewer.content import Content
from chauffeur.bench.viewer.page import write_view
from chauffeur.bench.viewer.server import MOST_MESSAGE_BYTES, Viewer
from chauffeur.cli.main import app
from chauffeur.concept import DataError
from report_folders import mixed, outcome, read_lines, write, write_lines, write_run
from small_run import COMMANDS

pytestmark = pytest.mark.server


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_folders(tmp_path_factory.mktemp("viewer"))


@pytest.fixture(scope="module")
def content(root: Path) -> Content:
    return content_of(root / "runs", root / "trips")


async def ask(socket: Any, key: str) -> Any:
    """An answer of a served viewer, what it says unasked left aside."""
    await socket.send(json.dumps({"n": 7, "key": key}))
    while "n" not in (told := json.loads(await socket.recv())):
        pass
    return told.get("answer", told.get("trouble"))


def talk_to(viewer: Viewer, **more: Any) -> Any:
    origin = viewer.url.rsplit("/", 2)[0]
    address = f"{viewer.url.replace('http', 'ws', 1)}talk"
    return connect(address, **({"origin": origin, "max_size": None} | more))


def test_the_page_is_served_to_this_machine_under_the_token(content: Content) -> None:
    async def check() -> None:
        viewer = Viewer(content)
        async with viewer.serving(), httpx.AsyncClient() as browser:
            token = viewer.url.rstrip("/").rsplit("/", 1)[1]
            assert viewer.url.startswith("http://127.0.0.1:") and len(token) >= 24
            answer = await browser.get(viewer.url)
            policy = answer.headers["content-security-policy"]
            assert answer.status_code == 200 and "unsafe" not in policy and "default-src 'none'" in policy
            assert token not in answer.text and "style=" not in answer.text and " onclick" not in answer.text
            for block in ("style", "script"):
                text = re.search(f"<{block}>(.*?)</{block}>", answer.text, re.DOTALL)
                assert text is not None
                digest = base64.b64encode(hashlib.sha256(text.group(1).encode()).digest()).decode()
                assert f"'sha256-{digest}'" in policy
            assert (await browser.get(viewer.url, headers={"Host": "evil.example"})).status_code == 421
            assert (await browser.get(f"{viewer.url.rsplit('/', 2)[0]}/wrong/")).status_code == 403
            for origin in ("http://evil.example", "null", None):
                with pytest.raises(InvalidStatus) as caught:
                    async with talk_to(viewer, origin=origin):
                        pass
                assert caught.value.response.status_code == 403

    asyncio.run(check())


def test_a_page_that_asks_nonsense_is_told_so_and_goes_on(content: Content) -> None:
    async def check() -> None:
        viewer = Viewer(content)
        async with viewer.serving(), talk_to(viewer) as socket:
            for key in ("", "etc/passwd", "rows", "rows ../../x", "sample x", "sample x y", "rows x y z"):
                assert isinstance(await ask(socket, key), str), key
            name = ids_of(content)["recorded"]
            assert "no row 99" in await ask(socket, f"sample {name} 99")
            await socket.send("[" * 400)
            assert "cannot be shown" in json.loads(await socket.recv())["trouble"]
            assert (await ask(socket, f"rows {name}"))["done"] == 10
            await socket.send("x" * (MOST_MESSAGE_BYTES + 1))
            with pytest.raises(ConnectionClosed):
                while True:
                    await socket.recv()

    asyncio.run(check())


def test_a_served_run_tells_of_a_new_one(root: Path, tmp_path: Path) -> None:
    content = content_of(tmp_path)

    async def check() -> None:
        viewer = Viewer(content)
        async with viewer.serving(), talk_to(viewer) as socket, asyncio.timeout(60):
            assert (await ask(socket, "index"))["runs"] == []
            write_run(tmp_path / "new", [[outcome()]])
            while not (found := json.loads(await socket.recv())["index"]["runs"]):
                pass
            assert found[0]["where"] == f"{tmp_path.name}/new" and found[0]["done"] == 1

    asyncio.run(check())


def test_the_list_says_what_ran_how_far_and_by_whom_it_was_judged(content: Content) -> None:
    index = content.index()
    lines = {line["where"]: line for line in index["runs"]}
    assert sorted(lines) == ["runs/faithfulness", "runs/mobil", "runs/recorded"]
    run = lines["runs/recorded"]
    assert (run["state"], run["done"], run["planned"], run["simulated"]) == ("finished", 10, 10, True)
    assert run["headline"]["title"] == "Driving score" and "evaluators" in run["judge"]
    read = lines["runs/faithfulness"]
    assert read["headline"]["title"] == "F1" and not read["simulated"]
    (trip,) = index["trips"]
    assert trip["outcome"] == "Done" and trip["where"] == "trips/overtake/trip.mcap"


def test_rows_have_what_all_benchmarks_have_and_their_own_columns(content: Content) -> None:
    rows = content.rows(ids_of(content)["recorded"])
    assert rows["group"] == "family" and {"ttc_lane_s", "detail"} & set(rows["columns"])
    shown = {row["words"]: row for row in rows["rows"]}
    assert shown[COMMANDS[0]]["ending"] == "done" and not shown[COMMANDS[0]]["wrong"]
    assert shown[COMMANDS[4]]["causes"] == ["refused"] and shown[COMMANDS[4]]["wrong"]
    assert all(len(row["cells"]) == len(rows["columns"]) for row in rows["rows"])
    read = content.rows(ids_of(content)["faithfulness"])
    assert read["group"] == "label" and read["rows"][0]["ending"] == "aligned"


def test_a_sample_is_told_whole_and_driven_again(content: Content) -> None:
    name = ids_of(content)["recorded"]
    rows = content.rows(name)["rows"]
    place = next(at for at, row in enumerate(rows) if row["words"] == COMMANDS[0])
    sample = content.sample(name, place)
    assert sample["goal"].startswith("Be in the lane to the left") and "highway" in sample["context"]
    assert sample["thoughts"] == "As you wish." and sample["program"] and sample["drivable"]
    assert sample["ending"].startswith("Done") and sample["verdicts"]
    drive = content.drive(name, place)
    assert drive["note"] == "" and drive["page"].startswith("<!doctype html>") and 'class="embedded"' in drive["page"]
    refused = next(at for at, row in enumerate(rows) if row["words"] == COMMANDS[4])
    told = content.sample(name, refused)
    assert not told["drivable"] and told["refusal"] == "I will not." and told["note"] == "Nothing was driven."


def test_two_runs_stand_side_by_side_on_what_they_share(content: Content) -> None:
    ids = ids_of(content)
    key = f"{ids['recorded']}+{ids['mobil']}"
    matches, (one, other) = content.matches(key), (content.rows(ids[name])["rows"] for name in ("recorded", "mobil"))
    assert len(matches) == 10
    assert all(one[a]["item"] == other[b]["item"] for a, b in matches)
    assert len(content.report(key)["pairs"]) == 1


def test_figures_lie_on_their_axes_and_the_first_table_has_a_plot(tmp_path: Path) -> None:
    write_run(tmp_path / "a", mixed(24))
    content = content_of(tmp_path)
    report = content.report(content.index()["order"][0])
    plots = [table["plot"] for table in report["tables"]]
    assert plots[0]["lines"][0]["name"] == "onboard" and plots[0]["marks"] and not any(plots[1:])
    bars = [cell["bar"] for table in report["tables"] for line in table["lines"] for cell in line["cells"]]
    bars += [line["bar"] for line in plots[0]["lines"]]
    places = [bar[end] for bar in bars if bar for end in ("low", "value", "high", "zero") if bar[end] is not None]
    assert len(places) > 20 and all(0.0 <= place <= 100.0 for place in places)
    assert report["tables"][0]["lines"][0]["cells"][-1]["text"] == "\N{MINUS SIGN}39.9"


def test_a_recording_is_shown_as_its_trip(content: Content, root: Path) -> None:
    assert "trip-data" in content.trip(ids_of(content)["overtake"])["page"]
    (root / "trips" / "broken.mcap").write_bytes(b"\x89MCAP0\r\nrubbish")
    try:
        broken = next(line for line in content.index()["trips"] if line["name"] == "broken.mcap")
        assert broken["state"] == "unreadable" and broken["trouble"]
        with pytest.raises(DataError):
            content.trip(broken["id"])
    finally:
        (root / "trips" / "broken.mcap").unlink()


def _live(folder: Path) -> Path:
    """A run killed in the middle of its work: half of its rows, the last line torn."""
    write_run(folder, mixed(4))
    rows = read_lines(folder / "results.jsonl")
    (folder / "results.jsonl").unlink()
    write_lines(folder / "live.jsonl", [{"item": row["item"], "rows": [row]} for row in rows[:4]])
    with (folder / "live.jsonl").open("a") as stream:
        stream.write('{"item": "task1_s')
    return folder


def test_rows_of_a_run_that_goes_on_are_there_and_a_killed_one_is_marked(tmp_path: Path) -> None:
    folder, content = _live(tmp_path / "run"), content_of(tmp_path)
    descriptor = os.open(folder / ".lock", os.O_RDWR | os.O_CREAT)
    fcntl.flock(descriptor, fcntl.LOCK_EX)
    (line,) = content.index()["runs"]
    assert (line["state"], line["done"], line["planned"]) == ("running", 4, 8)
    os.close(descriptor)
    (line,) = content.index()["runs"]
    assert line["state"] == "unfinished"
    rows = content.rows(line["id"])
    assert (rows["state"], len(rows["rows"])) == ("unfinished", 4)
    assert content.report(line["id"])["notices"] == ["onboard: only 4 of the run's 8 items."]


def test_a_run_that_has_only_begun_is_in_the_list(tmp_path: Path) -> None:
    folder = _live(tmp_path / "run")
    (folder / "live.jsonl").unlink()
    (folder / ".lock").touch()
    (line,) = content_of(tmp_path).index()["runs"]
    assert (line["state"], line["trouble"]) == ("unfinished", "No row yet.")


def test_a_benchmark_that_is_not_installed_is_shown_by_its_rows(tmp_path: Path) -> None:
    folder = tmp_path / "foreign"
    items = ["a", "b"]
    write(folder.parent / "plan.json", {})
    folder.mkdir()
    write(folder / "plan.json", {"bench": "other-v1", "config": {"planner": "theirs"}, "items": items})
    kept = highway_recording(folder / "drives" / "a.mcap")
    rows = [{"item": "a", "question": "Which lane?", "answer": "left", "drive": kept}, {"item": "b", "score": 0.25}]
    write_lines(folder / "results.jsonl", rows)
    content = content_of(tmp_path)
    (line,) = content.index()["runs"]
    shown = content.rows(line["id"])
    assert [(row["words"], row["ending"], row["wrong"]) for row in shown["rows"]] == [
        ("Which lane?", "left", None),
        ("b", "", None),
    ]
    assert content.sample(line["id"], 0)["drivable"] and "trip-data" in content.drive(line["id"], 0)["page"]
    assert not content.sample(line["id"], 1)["drivable"]
    outside = rows[0] | {"drive": "../../etc/x.mcap"}
    write_lines(folder / "results.jsonl", [outside])
    assert not content.sample(line["id"], 0)["drivable"]


def highway_recording(path: Path) -> str:
    from sample_trips import highway_trip

    from chauffeur.driving.recording import write_trip

    trip = highway_trip(seconds=2.0)
    write_trip(path, trip.trip, trip.frames, trip.scenario, final=trip.final)
    return f"{path.parent.name}/{path.name}"


def test_a_damaged_run_is_named_and_hides_no_other(tmp_path: Path) -> None:
    write_run(tmp_path / "good", [[outcome()]])
    write_run(tmp_path / "bad", [[outcome()]])
    (tmp_path / "bad" / "results.jsonl").write_text('{"item": "nobody planned this"}\n')
    states = {line["where"].rsplit("/", 1)[-1]: line for line in content_of(tmp_path).index()["runs"]}
    assert states["good"]["state"] == "finished"
    assert states["bad"]["state"] == "unreadable" and "never planned" in states["bad"]["trouble"]


class _Page(HTMLParser):
    """Tags and attributes as a browser would find them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))


def _exported(content: Content, path: Path, drives: int | None = None) -> str:
    index = content.index()
    write_view(path, content, index["order"], [line["id"] for line in index["trips"]], drives)
    return path.read_text(encoding="utf-8")


def test_an_exported_page_holds_all_and_asks_nobody(content: Content, tmp_path: Path) -> None:
    text = _exported(content, tmp_path / "page.html")
    policies = [one["content"] or "" for tag, one in _Page(text).found if tag == "meta" and "http-equiv" in one]
    policy = unescape(policies[0])
    assert policy.startswith("default-src 'none'") and "connect-src" not in policy and "unsafe" not in policy
    assert not re.search(r"(src|href)=\"?https?:|@import|url\(", text)
    packs = dict(re.findall(r'data-pack="([^"]+)">([^<]+)<', text))
    ids = ids_of(content)
    samples = json.loads(gzip.decompress(base64.b64decode(packs[f"samples {ids['recorded']}"])))
    assert len(samples) == 10 and samples[0]["program"]
    assert any(key.startswith(f"drive {ids['recorded']}") for key in packs)
    both = "+".join(name for name in content.index()["order"] if name in (ids["recorded"], ids["mobil"]))
    assert f"matches {both}" in packs and f"report {both}" in text


def test_what_was_written_stays_text(tmp_path: Path) -> None:
    write_run(
        tmp_path / "runs" / "a", mixed(4), planner=HOSTILE, command=HOSTILE, thoughts=HOSTILE, labels=(HOSTILE,),
        row={"detail": HOSTILE, "family": HOSTILE},
    )  # fmt: skip
    text = _exported(content_of(tmp_path / "runs"), tmp_path / "page.html", 0)
    tags = [tag for tag, _ in _Page(text).found]
    assert not {"img", "iframe", "object", "link", "form"} & set(tags)
    scripts = [attributes for tag, attributes in _Page(text).found if tag == "script"]
    assert all(set(one) <= {"type", "id", "data-pack"} for one in scripts)
    assert sum(not one for one in scripts) == 1, "one script of the page's own"


def test_the_command_exports_and_says_what_is_missing(root: Path, tmp_path: Path) -> None:
    run = CliRunner().invoke(
        app, ["view", str(root / "runs" / "recorded"), "--export", str(tmp_path / "one.html"), "--gallery", "1"]
    )
    assert run.exit_code == 0 and "one.html" in run.output
    text = (tmp_path / "one.html").read_text(encoding="utf-8")
    assert text.count('data-pack="drive ') == 1 and '"opens":"#/runs/' in text
    for arguments, said in (
        ([str(tmp_path / "none")], "No such folder"),
        ([str(tmp_path), "--export", "x.html"], "no run"),
    ):
        run = CliRunner().invoke(app, ["view", *arguments])
        assert run.exit_code != 0 and said in " ".join(run.output.split())


def test_the_command_serves_until_ctrl_c(root: Path) -> None:
    command = [sys.executable, "-m", "chauffeur", "view", str(root / "runs")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        assert url.startswith("http://127.0.0.1:")
        assert httpx.get(url).status_code == 200
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120)
    assert (process.returncode, errors) == (0, "")
