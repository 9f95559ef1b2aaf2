"""Who does the damage, tried alone: the vandal on real rings, the language model over real HTTP, the table."""

from __future__ import annotations

import http.client
import json
import os
import signal
import time
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from chauffeur.bench.chaos import replies
from chauffeur.bench.chaos.model import FAULTS, ModelServer, Script
from chauffeur.bench.chaos.table import failures, figures, headline, table_markdown
from chauffeur.bench.chaos.vandal import DEEDS, Vandal
from chauffeur.bench.chaos.witness import Stall, Witness, stood_ns
from chauffeur.concept import Setpoints
from chauffeur.drive.live.messages import LiveSetpoints, MessageError, MirroredInstant
from chauffeur.drive.live.settings import SIZES, ring

FOREVER_NS = (1 << 63) - 1


@pytest.fixture
def rings(tmp_path):
    made = {name: ring(tmp_path, name, create=True) for name in SIZES}
    made["observations"].write(MirroredInstant(3, 40, b"x").encode())
    wish = LiveSetpoints(3, 40, "w1", time.monotonic_ns(), FOREVER_NS, "running", 1, Setpoints(20.0))
    made["setpoints"].write(wish.encode())
    yield made
    for each in made.values():
        each.close()


@pytest.mark.parametrize("what", DEEDS)
def test_whatever_the_vandal_does_a_reader_gets_a_message_or_none(tmp_path, rings, what: str) -> None:
    vandal = Vandal(tmp_path)
    vandal.remember()
    before = {name: bytes(each._map) for name, each in rings.items()}
    vandal.do(what, 5, 0.02)
    assert any(bytes(each._map) != before[name] for name, each in rings.items() if name != "orders") or "orders" in what
    for name, each in rings.items():
        message = each.latest()
        if name == "setpoints" and message is not None:
            try:
                wish = LiveSetpoints.decode(message.payload)
            except MessageError:
                continue
            assert 0.0 <= (wish.setpoints.target_speed_mps or 0.0) <= 100.0


def asked(url: str, words: str) -> tuple[int, bytes]:
    parts = urlsplit(url)
    connection = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=5.0)
    body = json.dumps({"messages": [{"role": "user", "content": words}]})
    connection.request("POST", "/v1/chat/completions", body)
    answer = connection.getresponse()
    try:
        return answer.status, answer.read(200_000)
    except (OSError, http.client.HTTPException):
        return answer.status, b"cut"
    finally:
        connection.close()


@pytest.mark.server
def test_the_model_answers_well_unless_told_otherwise() -> None:
    good = dict(replies.WISHES["highway"])
    with ModelServer() as server:
        server.script = Script(good=good, fault="http-500", times=1)
        assert asked(server.url, "Drive 27 m/s.")[0] == 500
        status, body = asked(server.url, "Slow down to 20 m/s. Drive 27 m/s.")
        assert status == 200 and b"27.0" in body and b"[DONE]" in body
        assert (server.script.asked, server.script.hit) == (2, 1)


@pytest.mark.server
@pytest.mark.parametrize("fault", [name for name in FAULTS if name not in ("", "silent", "trickle")])
def test_every_fault_is_another_answer_than_the_good_one(fault: str) -> None:
    good = dict(replies.WISHES["highway"])
    with ModelServer() as server:
        server.script = Script(good=good)
        right = asked(server.url, "Drive 27 m/s.")
        server.script = Script(good=good, fault=fault, times=1)
        assert asked(server.url, "Drive 27 m/s.") != right
        assert server.script.hit == 1


def row(**changes):
    plain = {
        "case": 1, "kind": "policy-killed", "family": "process", "stage": "running", "unsafe": [], "lost": [],
        "left_behind": [], "wishes": [{"words": "a"}], "ticks": 100, "worst": "hold",
        "deeds": {"missed": 0, "longest_silence": 1.1}, "machine_stood_ms": 0,
        "to_follow_s": 0.5, "to_new_plan_s": None,
    }  # fmt: skip
    return plain | changes


def test_the_table_counts_and_names_what_failed() -> None:
    rows = [
        row(),
        row(case=2, unsafe=["too fast"], worst="stop", to_follow_s=None),
        row(case=3, lost=["a"], to_follow_s=0.0, deeds={"missed": 4, "longest_silence": 5.0}, machine_stood_ms=80),
        row(case=4, unsafe=["control was silent"], deeds={"missed": 9, "longest_silence": 9.0}, machine_stood_ms=30),
    ]
    found = figures(rows)["policy-killed"]
    assert (found["cases"], found["unsafe"], found["lost"], found["missed"]) == ("4", "2", "1", "13")
    assert (found["worst level"], found["back s p50"], found["not back"]) == ("stop", "0.50", "1")
    assert len(failures(rows)) == 3 and "case 2" in failures(rows)[0]
    assert "4 cases 2 led to unsafe actuation and 1 of 4 wishes" in headline(rows)
    assert (
        "In 1 of the safe cases control was silent while the machine itself stood still, for up to 80 ms."
        in headline(rows)
    )
    assert "stood still" not in headline(rows[:2])
    assert "| policy-killed | 4 | 2 | 1 |" in table_markdown(rows, "T")


def test_a_witness_sees_its_own_cpu_stand_still_and_nothing_else() -> None:
    with Witness() as witness:
        if not witness.able:
            pytest.skip("this machine does not allow real-time scheduling")
        stopped = witness.processes[0]
        before = time.monotonic_ns()
        os.kill(stopped, signal.SIGSTOP)
        time.sleep(0.12)
        os.kill(stopped, signal.SIGCONT)
        cpu, until = min(os.sched_getaffinity(0)), time.monotonic() + 10.0
        own: list[Stall] = []
        while not own and time.monotonic() < until:  # it says so when it gets to run
            time.sleep(0.01)
            seen = witness.stalls(before, time.monotonic_ns())
            own = [one for one in seen if one.cpu == cpu and one.to_ns - one.from_ns > 80 * 10**6]
        first = max(own, key=lambda one: one.to_ns - one.from_ns)
        assert before - 50 * 10**6 < first.from_ns
        assert stood_ns([first], first.from_ns, first.to_ns) == first.to_ns - first.from_ns
        assert witness.stalls(0, before - 10**9) == ()
    assert all(not Path(f"/proc/{process}").exists() for process in witness.processes)
