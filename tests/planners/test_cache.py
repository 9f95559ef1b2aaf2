"""Kept replies: the exact request or nothing, private, and never the reason a plan fails."""

from __future__ import annotations

import json
import logging
import os
import stat
from concurrent.futures import ThreadPoolExecutor

import pytest
from server import PROGRAM, REPLY, fails, stream

from chauffeur.concept import Program
from chauffeur.planners.cache import Completion, ReplyCache, content_key, default_cache_dir, endpoint_key
from chauffeur.planners.llm_endpoint import Sampling
from chauffeur.planners.llm_model import cost_usd

KEY = "ab" * 32
KEPT = Completion("text é \u2028", "stop", 10, 5, "m-1")


def path_of(cache: ReplyCache):
    return cache.folder / KEY[:2] / f"{KEY}.json"


def test_what_was_put_comes_back(tmp_path):
    cache = ReplyCache(tmp_path)
    assert cache.get(KEY) is None
    cache.put(KEY, KEPT)
    assert cache.get(KEY) == KEPT


def test_only_the_owner_can_read_it_and_the_root_is_left_alone(tmp_path):
    tmp_path.chmod(0o755)
    cache = ReplyCache(tmp_path)
    cache.folder.mkdir(mode=0o777)
    cache.folder.chmod(0o777)
    before = os.umask(0)
    try:
        cache.put(KEY, KEPT)
    finally:
        os.umask(before)
    assert stat.S_IMODE(tmp_path.stat().st_mode) == 0o755
    assert stat.S_IMODE(cache.folder.stat().st_mode) == 0o700
    assert stat.S_IMODE(path_of(cache).parent.stat().st_mode) == 0o700
    assert stat.S_IMODE(path_of(cache).stat().st_mode) == 0o600


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"null",
        b"[]",
        b'"x"',
        b"\xff\xfe",
        b"{}",
        b'{"reply": {}}',
        b'{"reply": {"text": 1}}',
        b"[" * 100_000,
        b'{"reply": 5}',
    ],
)
def test_corrupt_entries_are_ignored_and_replaced(tmp_path, content, caplog):
    cache = ReplyCache(tmp_path)
    cache.put(KEY, KEPT)
    path_of(cache).write_bytes(content)
    assert cache.get(KEY) is None
    assert "unusable" in caplog.text
    cache.put(KEY, KEPT)
    assert cache.get(KEY) == KEPT


def test_a_changed_word_and_a_misplaced_entry_are_not_believed(tmp_path):
    cache = ReplyCache(tmp_path)
    cache.put(KEY, KEPT)
    entry = json.loads(path_of(cache).read_text())
    path_of(cache).write_text(json.dumps(entry | {"reply": entry["reply"] | {"text": "set_target_speed(99)"}}))
    assert cache.get(KEY) is None
    other = "cd" * 32
    (cache.folder / "cd").mkdir()
    (cache.folder / "cd" / f"{other}.json").write_text(json.dumps(entry))
    assert cache.get(other) is None


def test_a_full_or_forbidden_disk_is_only_a_warning(tmp_path, monkeypatch, caplog):
    cache = ReplyCache(tmp_path / "file")
    (tmp_path / "file").write_text("not a folder")
    cache.put(KEY, KEPT)
    assert cache.get(KEY) is None
    assert "not cached" in caplog.text
    whole = ReplyCache(tmp_path)

    def full(*args, **kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(json, "dump", full)
    whole.put(KEY, KEPT)
    assert [path for path in tmp_path.rglob("*") if path.suffix in {".json", ".tmp"}] == []


def test_many_writers_leave_one_whole_entry(tmp_path):
    cache = ReplyCache(tmp_path)
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda number: cache.put(KEY, Completion("x" * number, "stop")), range(200)))
    assert cache.get(KEY) is not None
    assert [path.name for path in path_of(cache).parent.iterdir()] == [path_of(cache).name]


def test_clear_erases_everything(tmp_path):
    cache = ReplyCache(tmp_path)
    cache.put(KEY, KEPT)
    assert cache.clear() == 1
    assert cache.get(KEY) is None and cache.clear() == 0


def test_the_key_hangs_on_everything_that_decides_the_reply():
    messages = [{"role": "user", "content": "a"}]
    keys = [
        endpoint_key("http://h/v1", "m", messages, {"temperature": 0.0}),
        endpoint_key("http://g/v1", "m", messages, {"temperature": 0.0}),
        endpoint_key("http://h/v2", "m", messages, {"temperature": 0.0}),
        endpoint_key("http://h/v1", "n", messages, {"temperature": 0.0}),
        endpoint_key("http://h/v1", "m", [*messages, *messages], {"temperature": 0.0}),
        endpoint_key("http://h/v1", "m", [{"role": "system", "content": "a"}], {"temperature": 0.0}),
        endpoint_key("http://h/v1", "m", messages, {"temperature": 0.1}),
        endpoint_key("http://h/v1", "m", messages, {"temperature": 0.0, "seed": 0}),
    ]
    assert len(set(keys)) == len(keys)
    assert content_key({"a": 1, "b": 2}) == content_key({"b": 2, "a": 1})


def test_the_default_place_follows_the_desktop_convention(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert default_cache_dir() == tmp_path / "chauffeur"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert default_cache_dir().parts[-2:] == (".cache", "chauffeur")


@pytest.mark.server
def test_the_same_request_is_sent_once(server, bench, tmp_path):
    first = bench.plan(cache=ReplyCache(tmp_path))
    heard: list[tuple[str, int]] = []
    bench.environ = {}
    again = bench.plan(cache=ReplyCache(tmp_path), on_text=lambda *piece: heard.append(piece))
    assert len(server.requests) == 1
    assert (again.policy, again.raw, again.model) == (first.policy, first.raw, first.model)
    assert again.usage.cached and again.usage.requests == 0 and again.usage.prompt_tokens == 1000
    assert not first.usage.cached
    assert heard == [(REPLY, 0)]
    bench.plan(cache=ReplyCache(tmp_path), sampling=Sampling(seed=1))
    bench.plan("another wish", cache=ReplyCache(tmp_path))
    bench.plan(cache=None)
    assert len(server.requests) == 4


@pytest.mark.server
def test_both_halves_of_a_repair_are_kept(server, bench, tmp_path):
    server.script(stream(REPLY.replace("25.0", "99.0")), stream(REPLY))
    gate = {"gate": lambda source: ["too fast"] if "99" in source else []}
    bench.plan(cache=ReplyCache(tmp_path), **gate)
    server.script(fails(500))
    plan = bench.plan(cache=ReplyCache(tmp_path), **gate)
    assert plan.policy == Program(PROGRAM) and plan.usage.cached


@pytest.mark.server
@pytest.mark.parametrize("answer", [stream(""), stream(REPLY, finish="length"), stream(REPLY, finish="content_filter")])
def test_only_whole_replies_are_kept(server, bench, tmp_path, answer):
    server.script(answer)
    bench.plan(cache=ReplyCache(tmp_path), repairs=0)
    assert list(tmp_path.rglob("*.json")) == []


@pytest.mark.server
def test_no_words_of_the_person_are_kept(server, bench, tmp_path):
    bench.plan("drive me to my lover's house", cache=ReplyCache(tmp_path))
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert files and all(b"lover" not in path.read_bytes() for path in files)


@pytest.mark.server
def test_a_cache_nobody_can_write_costs_no_plan(server, bench, tmp_path, caplog):
    caplog.set_level(logging.WARNING)
    (tmp_path / "replies-v1").write_text("in the way")
    assert bench.plan(cache=ReplyCache(tmp_path)).policy is not None
    assert "not cached" in caplog.text


def test_prices_are_known_or_none():
    assert cost_usd("api.openai.com", "gpt-4o", 1_000_000, 100_000) == pytest.approx(3.5)
    assert cost_usd("api.openai.com", "gpt-4o-2024-08-06", 1000, 0) == pytest.approx(0.0025)
    assert cost_usd("localhost", "gpt-4o", 1000, 0) is None
    assert cost_usd("api.openai.com", "gpt-99", 1000, 0) is None
