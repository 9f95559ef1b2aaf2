"""The chain: what was written verifies, and whatever was done to it in the middle is found and named."""

from __future__ import annotations

import errno
import hashlib
import hmac
import json
import os
import re
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import pytest
from audit_logs import ABOUT, BROKEN, KEY, OTHER_KEY, WISH, chain, fields, look, old_log, refusing, write
from golden_sentences import compare
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chauffeur.concept import ChauffeurError, PersonId
from chauffeur.safety.audit import (
    KINDS,
    AuditLog,
    head_path,
    read_key,
    read_records,
    reader,
    redact,
    redaction,
    verify,
    words_of,
)
from chauffeur.safety.audit.entries import AuditRecord, NotARecordError, canonical, parse, seal, storable
from chauffeur.safety.audit.keys import key_name
from chauffeur.safety.audit.reader import AuditLine, lines
from chauffeur.safety.audit.storage import LogFile
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


def test_a_key_is_called_by_sixteen_digits_of_its_seal() -> None:
    assert key_name(KEY) == hmac.new(KEY, b"chauffeur-audit-key-1\0", "sha256").hexdigest()[:16]


@pytest.mark.parametrize("length", [16, 17, 4095, 4096])
def test_keys_of_a_fit_length_are_read_whole(tmp_path: Path, length: int) -> None:
    (tmp_path / "key").write_bytes(b"k" * length)
    assert read_key(tmp_path / "key") == b"k" * length


def test_a_log_comes_line_by_line_and_what_is_too_long_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "MAX_LINE_BYTES", 4)
    assert list(lines(BytesIO(b"abc\n\nabcdefg\nab"))) == [
        AuditLine(1, b"abc", whole=True),
        AuditLine(2, b"", whole=True),
        AuditLine(3, b"abcd", whole=True),  # no record, but nothing that a write was cut off in either
        AuditLine(4, b"efg", whole=True),
        AuditLine(5, b"ab", whole=False),
    ]


def test_what_follows_the_last_line_end_is_no_record(tmp_path: Path) -> None:
    first, second = chain(("opened", {}), ("wish", {}))
    (tmp_path / "log").write_bytes(first + b"\n" + second + second[:-1])
    assert [(number, record.kind) for number, record in read_records(tmp_path / "log")] == [(1, "opened"), (3, "wish")]


def test_what_json_lacks_is_stored_in_words() -> None:
    odd = {1: float("nan"), "a": (float("inf"), [float("-inf"), {None: 0.5}]), "b": 7}
    assert storable(odd) == {"1": "NaN", "a": ["Infinity", ["-Infinity", {"None": 0.5}]], "b": 7}


FIELDS = {"body": {}, "hash": "h", "kind": "wish", "prev": "p", "seq": 0, "time": "t"}


@pytest.mark.parametrize("seq", [0, (1 << 63) - 1])
def test_a_bare_record_has_no_texts_and_no_seal(seq: int) -> None:
    assert parse(canonical(FIELDS | {"seq": seq})) == AuditRecord(seq, "t", "wish", {}, "p", "h", {}, "")


# What cannot be used --------------------------------------------------------------------------------------------------

Patch = pytest.MonkeyPatch
ANA = PersonId("ana")
NO_MEDIUM = OSError("no medium")


def holding(content: bytes) -> Callable[[Path], object]:
    return lambda path: path.write_bytes(content)


def nothing(path: Path) -> None:
    pass


def plain(path: Path) -> None:
    write(path)


def keyed(path: Path) -> None:
    write(path, key=KEY)


def changed(path: Path) -> None:
    keyed(path)
    path.write_bytes(path.read_bytes().replace(b"format-v1", b"format-v2", 1))


def cut_off(path: Path) -> None:
    keyed(path)
    path.write_bytes(path.read_bytes().splitlines(keepends=True)[0])


def with_head(content: bytes) -> Callable[[Path], object]:
    def make(path: Path) -> None:
        write(path)
        head_path(path).write_bytes(content)

    return make


def patched(owner: object, name: str, error: OSError, act: Callable[[Path], object]) -> Callable[[Path, Patch], object]:
    def do(path: Path, patch: Patch) -> None:
        patch.setattr(owner, name, refusing(error))
        act(path)

    return do


def erase(path: Path, patch: Patch) -> None:
    redact(path, ANA, key=KEY)


def erase_while_it_is_written(path: Path, patch: Patch) -> None:
    with AuditLog(path, about={}, key=KEY):
        erase(path, patch)


def write_on(path: Path, key: bytes | None = None) -> None:
    AuditLog(path, about={}, key=key)


def write_twice(path: Path, patch: Patch) -> None:
    with AuditLog(path, about={}):
        write_on(path)


UNUSABLE: dict[str, tuple[Callable[[Path], object], Callable[[Path, Patch], object]]] = {
    **{f"a key of {size} bytes": (holding(b"k" * size), lambda path, _: read_key(path))
       for size in (0, 15, 4097, 9000)},
    **{f"a key, {error}": (nothing, patched(Path, "open", error, read_key)) for error in (BROKEN, NO_MEDIUM)},
    "no log": (nothing, lambda path, _: verify(path)),
    **{f"a log, {error}": (plain, patched(Path, "open", error, lambda path: [*read_records(path)]))
       for error in (BROKEN, NO_MEDIUM)},
    "no record": (holding(b"Dear diary\n"), lambda path, _: verify(path)),
    "a newer log": (holding(chain(("opened", {"format": 3}))[0]), lambda path, _: verify(path)),
    "a head given": (plain, lambda path, _: verify(path, head="X" * 64)),
    "a head beside it": (with_head(b"A" * 64), lambda path, _: verify(path)),
    "a head in other letters": (with_head(b"\xe9"), lambda path, _: verify(path)),
    "a head that is damaged": (with_head(b"{"), lambda path, _: verify(path)),
    "erasing in no log": (nothing, erase),
    "erasing without the key": (keyed, lambda path, _: redact(path, ANA)),
    "erasing under another key": (keyed, lambda path, _: redact(path, ANA, key=OTHER_KEY)),
    "erasing what was changed": (changed, erase),
    "erasing what is written": (keyed, erase_while_it_is_written),
    **{f"erasing, {error}": (plain, patched(redaction, "replace_whole", error, lambda path: redact(path, ANA)))
       for error in (BROKEN, NO_MEDIUM)},
    **{f"writing on in {content!r}": (holding(content), lambda path, _: write_on(path))
       for content in (b"no line end", b"a line\n", b"a line\nand a half", b'{"body":[', b"no")},
    "writing on without the key": (keyed, lambda path, _: write_on(path)),
    "writing on under another key": (keyed, lambda path, _: write_on(path, OTHER_KEY)),
    "writing on in what was changed": (changed, lambda path, _: write_on(path, KEY)),
    "writing on in what was cut off": (cut_off, lambda path, _: write_on(path, KEY)),
    "writing on in an old log under a key": (lambda path: old_log(path, KEY), lambda path, _: write_on(path, KEY)),
    "two writers": (plain, write_twice),
    "a log that is a folder": (Path.mkdir, lambda path, _: write_on(path)),
    "a log in a file": (holding(b""), lambda path, _: write_on(path / "log")),
    **{f"a new log, {error}": (nothing, patched(os, "open", error, write_on))
       for error in (OSError(errno.EROFS, "only for reading"), NO_MEDIUM)},
    "a head that is a folder": (lambda path: head_path(path).mkdir(), lambda path, _: write_on(path, KEY)),
}  # fmt: skip


def test_what_cannot_be_used_is_said_and_left_as_it_is(tmp_path: Path) -> None:
    said: dict[str, list[object]] = {}
    for number, (name, (make, use)) in enumerate(UNUSABLE.items()):
        path = tmp_path / str(number) / "log"
        path.parent.mkdir()
        make(path)
        before = path.read_bytes() if path.is_file() else None
        with pytest.raises(ChauffeurError) as caught, pytest.MonkeyPatch.context() as patch:
            use(path, patch)
        error = caught.value
        texts = (text.replace(str(path), "PATH") for text in (error.message, error.hint))
        said[name] = [type(error).__name__, *(re.sub(r"\b[0-9a-f]{64}\b", "HASH", text) for text in texts)]
        if before is not None and use in (erase_while_it_is_written, write_twice):
            assert path.read_bytes().startswith(before), name
        elif not path.is_dir():
            assert (path.read_bytes() if path.is_file() else b"") == (before or b""), name
        if path.is_file():
            LogFile(path).close()  # the lock was given back
    compare("audit: errors", said)
