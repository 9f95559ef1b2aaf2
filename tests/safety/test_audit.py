"""The chain: what was written verifies, and whatever was done to it in the middle is found and named."""

from __future__ import annotations

import hashlib
import hmac
import json
import re
from pathlib import Path

import pytest
from audit_logs import ABOUT, KEY, OTHER_KEY, WISH, fields, look, write
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chauffeur.safety.audit import KINDS, head_path, read_records, verify, words_of
from chauffeur.safety.audit.entries import NotARecordError, parse, seal, storable
from chauffeur.version import __version__

VARIANTS = {"plain": {}, "keyed": {"key": KEY}, "private": {"private": True}, "both": {"key": KEY, "private": True}}


@pytest.fixture(scope="module", params=VARIANTS)
def log(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, str, bytes | None]:
    """(content, head, key) of a log of each sort."""
    options = VARIANTS[request.param]
    path = tmp_path_factory.mktemp("log") / "audit.jsonl"
    closing = write(path, **options)
    assert closing.complete
    return path.read_bytes(), closing.head, options.get("key")


@pytest.fixture(scope="module")
def plain_log(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, str]:
    path = tmp_path_factory.mktemp("plain") / "audit.jsonl"
    closing = write(path)
    return path.read_bytes(), closing.head


def test_what_was_written_verifies(log: tuple[bytes, str, bytes | None]) -> None:
    content, head, key = log
    found = look(content, head=head, key=key)
    assert found.ok, found.findings
    assert (found.head, found.after_head, found.torn_bytes, found.closed) == (head, 0, 0, True)
    assert found.records == content.count(b"\n") == 14
    assert found.kinds["wish"] == 2
    assert found.key == ("none" if key is None else "checked")


def test_the_first_record_says_what_wrote_it(plain_log: tuple[bytes, str]) -> None:
    first = fields(plain_log[0].splitlines()[0])
    assert first["kind"] == "opened"
    assert first["prev"] == "0" * 64
    assert first["body"] == ABOUT | {"format": 2, "chauffeur": __version__, "key": "", "private": False}
    assert first["time"] == "2026-01-02T03:04:05.100+00:00"


def test_the_hashes_can_be_computed_with_nothing_but_a_standard_library(plain_log: tuple[bytes, str]) -> None:
    before = "0" * 64
    for number, line in enumerate(plain_log[0].splitlines()):
        record = json.loads(line)
        texts = record.pop("texts", {})
        stated = record.pop("hash")
        assert record["prev"] == before
        assert record["seq"] == number
        form = json.dumps(record, sort_keys=True, separators=(",", ":"))
        before = hashlib.sha256(form.encode()).hexdigest()
        assert before == stated
        for name, text in texts.items():
            content = bytes.fromhex(text["salt"]) + b"text\0" + text["text"].encode("utf-8", "surrogatepass")
            assert record["body"]["texts"][name] == {"digest": hashlib.sha256(content).hexdigest()}
    assert before == plain_log[1]


def test_the_seal_can_be_computed_with_nothing_but_a_standard_library(tmp_path: Path) -> None:
    write(tmp_path / "audit.jsonl", key=KEY)
    for line in (tmp_path / "audit.jsonl").read_bytes().splitlines():
        record = json.loads(line)
        core = {name: record[name] for name in ("body", "kind", "prev", "seq", "time")}
        form = json.dumps(core, sort_keys=True, separators=(",", ":")).encode()
        assert record["mac"] == hmac.new(KEY, b"chauffeur-audit-record-1\0" + form, "sha256").hexdigest()


def test_the_documented_check_is_a_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    document = (Path(__file__).parents[2] / "docs" / "audit.md").read_text(encoding="utf-8")
    shown = re.search(r"```python\n(import hashlib.*?)```", document, re.DOTALL)
    assert shown is not None
    monkeypatch.chdir(tmp_path)
    for options in VARIANTS.values():
        path = tmp_path / "audit.jsonl"
        path.unlink(missing_ok=True)
        head_path(path).unlink(missing_ok=True)
        head = write(path, **options).head
        names: dict[str, object] = {}
        exec(shown[1], names)
        assert names["before"] == head
        path.write_bytes(path.read_bytes().replace(b"gap-v1", b"gap-v2", 1))
        with pytest.raises(AssertionError, match="line 5"):
            exec(shown[1], {})


def test_changes_of_single_bytes_all_over_are_found(log: tuple[bytes, str, bytes | None]) -> None:
    content, head, key = log
    # Every seventh byte of each sort of log; they have other lengths, so that together it is nearly every byte of one.
    for place in range(0, len(content) - 1, 7):
        changed = bytearray(content)
        changed[place] ^= 1
        assert not look(bytes(changed)).ok, (place, content[max(0, place - 30) : place + 30])
    cut = look(content[:-1], head=head, key=key)  # the very last line end: the closing record is then torn
    assert not cut.ok
    assert cut.torn_bytes


@given(st.integers(0), st.integers(0, 255))
@settings(max_examples=300, deadline=None)
def test_any_byte_put_anywhere_is_found(plain_log: tuple[bytes, str], place: int, byte: int) -> None:
    content, head = plain_log
    place %= len(content)
    assume(content[place] != byte)
    changed = content[:place] + bytes([byte]) + content[place + 1 :]
    found = look(changed, head=head)
    assert not found.ok
    line = content[:place].count(b"\n") + 1
    if place < len(content) - 1:
        assert any(finding.line in (line, line + 1) for finding in found.findings), found.findings


@given(st.sets(st.integers(0, 12), min_size=1))
@settings(max_examples=100, deadline=None)
def test_records_taken_out_of_the_middle_are_found(log: tuple[bytes, str, bytes | None], gone: set[int]) -> None:
    lines = log[0].splitlines(keepends=True)
    left = [line for number, line in enumerate(lines) if number not in gone]
    found = look(b"".join(left))
    assert not found.ok
    removed_at = min(gone) + 1
    assert found.findings[0].line == removed_at
    assert found.findings[0].code == ("begin_missing" if removed_at == 1 else "missing")


@given(st.integers(0, 13), st.integers(0, 13))
@settings(max_examples=100, deadline=None)
def test_exchanged_records_are_found(log: tuple[bytes, str, bytes | None], one: int, other: int) -> None:
    assume(one != other)
    lines = log[0].splitlines(keepends=True)
    lines[one], lines[other] = lines[other], lines[one]
    found = look(b"".join(lines))
    assert not found.ok
    assert found.findings[0].line == min(one, other) + 1


@given(st.integers(0, 13), st.integers(0, 13), st.booleans())
@settings(max_examples=100, deadline=None)
def test_inserted_records_are_found(plain_log: tuple[bytes, str], source: int, place: int, forged: bool) -> None:
    lines = plain_log[0].splitlines(keepends=True)
    extra = lines[source]
    if forged:  # one that fits what stands before it, with a right hash of its own
        before = fields(lines[place - 1])["hash"] if place else "0" * 64
        extra, _ = seal(place, before, "verdict", "2026-01-02T03:04:05.150+00:00", {"passed": True}, {}, None)
    found = look(b"".join([*lines[:place], extra, *lines[place:]]))
    assert not found.ok


@given(st.binary(min_size=1, max_size=40), st.integers(0, 13))
@settings(max_examples=100, deadline=None)
def test_foreign_lines_are_found(plain_log: tuple[bytes, str], junk: bytes, place: int) -> None:
    lines = plain_log[0].splitlines(keepends=True)
    found = look(b"".join([*lines[:place], junk + b"\n", *lines[place:]]))
    assert not found.ok
    assert found.findings[0].line == place + 1


def test_a_cut_off_end_is_found_by_the_head_alone(log: tuple[bytes, str, bytes | None]) -> None:
    content, head, key = log
    lines = content.splitlines(keepends=True)
    for kept in range(1, len(lines)):
        shortened = b"".join(lines[:kept])
        assert look(shortened, key=key).ok  # the chain does not know how long it should be: docs/audit.md says so
        assert not look(shortened, key=key).closed
        found = look(shortened, head=head, key=key)
        assert [finding.code for finding in found.findings] == ["head_absent"]


def _rewritten(content: bytes, key: bytes | None) -> bytes:
    """The log as somebody who knows the format would write it anew, with every verdict turned round."""
    before, lines = "0" * 64, list[bytes]()
    for line in content.splitlines():
        old = fields(line)
        if old["kind"] == "verdict":
            old["body"]["passed"] = False
        written, before = seal(old["seq"], before, old["kind"], old["time"], old["body"], old.get("texts", {}), key)
        lines.append(written)
    return b"".join(lines)


def test_a_log_written_anew_is_found_by_head_or_key(log: tuple[bytes, str, bytes | None]) -> None:
    content, head, key = log
    if key is None:
        forged = _rewritten(content, None)
        assert look(forged).ok  # docs/audit.md says so
        assert not look(forged, head=head).ok
        return
    for forger in (None, OTHER_KEY):
        assert not look(_rewritten(content, forger), key=key).ok
    assert look(_rewritten(content, key), key=key).ok  # who has the key can
    assert look(_rewritten(content, None)).findings[0].code == "seal_missing"
    assert look(content, key=OTHER_KEY).findings[0].code == "other_key"


def test_the_head_file_is_used_when_it_is_there(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    closing = write(path)
    assert head_path(path).read_text().strip() == closing.head
    assert verify(path).after_head == 0
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:-1]))
    assert not verify(path).ok
    assert verify(path, head=fields(lines[3])["hash"]).after_head == len(lines) - 5
    head_path(path).unlink()
    assert verify(path).after_head is None


def test_records_come_back(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    write(path)
    records = [record for _, record in read_records(path)]
    assert [record.kind for record in records][:3] == ["opened", "wish", "context"]
    assert set(KINDS) - {record.kind for record in records} == {"plan", "gap", "redaction"}
    assert words_of(records[1]) == {"person": "ana", "wish": f"{WISH} (ana)"}
    assert records[6].body["metrics"] == [{"value": "NaN"}]
    assert records[5].body["requested"][0][1].hex() == (-0.0).hex()


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=10,
)


@given(st.dictionaries(st.text(max_size=8), json_values, max_size=4), st.integers(0, 10**9))
@settings(max_examples=150, deadline=None)
def test_any_body_is_written_and_read(body: dict[str, object], seq: int) -> None:
    line, digest = seal(seq, "0" * 64, "plan", "now", body, {}, KEY)
    record = parse(line[:-1])
    assert (record.seq, record.hash, record.body) == (seq, digest, storable(body))


@given(
    st.binary(max_size=60) | st.text(max_size=60).map(str.encode) | json_values.map(lambda v: json.dumps(v).encode())
)
@settings(max_examples=150, deadline=None)
def test_what_is_no_record_is_refused_in_one_way(line: bytes) -> None:
    with pytest.raises(NotARecordError):
        parse(line)
