"""An audit log's key, head, lines and texts as they are written, and what is said where they cannot be used."""

from __future__ import annotations

import errno
import hashlib
import hmac
from collections.abc import Callable
from datetime import datetime, timedelta, timezone
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from audit_logs import KEY, OTHER_KEY, chain, far_east, fields, write

from chauffeur.concept import ConfigError, DataError, PersonId
from chauffeur.safety.audit import (
    head_path,
    read_key,
    read_records,
    reader,
    redact,
    redaction,
    says,
    verify,
    words_of,
)
from chauffeur.safety.audit.entries import (
    AuditRecord,
    canonical,
    content_hash,
    is_sealed_with,
    parse,
    seal,
    storable,
)
from chauffeur.safety.audit.heads import Head, read_head
from chauffeur.safety.audit.keys import key_name
from chauffeur.safety.audit.reader import AuditLine, lines, opened
from chauffeur.safety.audit.redaction import Redaction
from chauffeur.safety.audit.texts import TextState, erased, hide, states

WHEN = "2026-01-02T03:04:05.000+00:00"
MAKE_ONE = "Make one with: head -c 32 /dev/urandom > audit.key"
WRITE_ONE = "Write one with `chauffeur drive ... --audit FILE`."
PRINTED = "Give the hash that was printed when the log was closed."


def said(error: BaseException) -> tuple[str, str]:
    """(message, hint) of an error."""
    return getattr(error, "message", str(error)), getattr(error, "hint", "")


def refusing(error: OSError) -> Callable[..., Any]:
    def refuse(*_: Any, **__: Any) -> Any:
        raise error

    return refuse


# Keys --------------------------------------------------------------------------------------------------------------


def test_a_key_is_called_by_sixteen_digits_of_its_seal() -> None:
    assert key_name(KEY) == hmac.new(KEY, b"chauffeur-audit-key-1\0", "sha256").hexdigest()[:16]


@pytest.mark.parametrize(("length", "shown"), [(0, 0), (15, 15), (4097, 4097), (9000, 4097)])
def test_keys_too_short_or_long_are_refused(tmp_path: Path, length: int, shown: int) -> None:
    path = tmp_path / "key"
    path.write_bytes(b"k" * length)
    with pytest.raises(ConfigError) as caught:
        read_key(path)
    assert said(caught.value) == (f"The audit key {path} has {shown} bytes; 16 to 4096 are expected.", MAKE_ONE)


@pytest.mark.parametrize("length", [16, 17, 4095, 4096])
def test_keys_of_a_fit_length_are_read_whole(tmp_path: Path, length: int) -> None:
    (tmp_path / "key").write_bytes(b"k" * length)
    assert read_key(tmp_path / "key") == b"k" * length


@pytest.mark.parametrize(
    ("error", "why"),
    [(PermissionError(errno.EACCES, "Permission denied"), "Permission denied"), (OSError("no medium"), "no medium")],
)
def test_why_a_key_cannot_be_read_is_said(monkeypatch: pytest.MonkeyPatch, error: OSError, why: str) -> None:
    monkeypatch.setattr(Path, "open", refusing(error))
    with pytest.raises(ConfigError) as caught:
        read_key(Path("audit.key"))
    assert said(caught.value) == (f"The audit key audit.key cannot be read: {why}.", MAKE_ONE)


# Reading -----------------------------------------------------------------------------------------------------------


def test_where_there_is_no_log_it_is_said_how_to_write_one(tmp_path: Path) -> None:
    with pytest.raises(DataError) as caught, opened(tmp_path / "absent"):
        pass
    assert said(caught.value) == (f"There is no audit log at {tmp_path / 'absent'}.", WRITE_ONE)


@pytest.mark.parametrize(
    ("error", "why"),
    [(PermissionError(errno.EACCES, "Permission denied"), "Permission denied"), (OSError("no medium"), "no medium")],
)
def test_why_a_log_cannot_be_read_is_said(monkeypatch: pytest.MonkeyPatch, error: OSError, why: str) -> None:
    monkeypatch.setattr(Path, "open", refusing(error))
    with pytest.raises(DataError) as caught, opened(Path("log")):
        pass
    assert said(caught.value) == (f"The audit log log cannot be read: {why}.", "")


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


# The head ----------------------------------------------------------------------------------------------------------


def test_a_head_beside_a_log_is_read_without_its_line_end(tmp_path: Path) -> None:
    assert head_path(tmp_path / "log.jsonl") == tmp_path / "log.jsonl.head"
    assert read_head(tmp_path / "log") is None
    head_path(tmp_path / "log").write_text(f" {'0123456789abcdef' * 4}\n")
    assert read_head(tmp_path / "log") == Head("0123456789abcdef" * 4)


@pytest.mark.parametrize("head", ["", "a" * 63, "a" * 65, "A" * 64, "g" * 64, "X" * 64])
def test_what_is_no_head_is_said(tmp_path: Path, head: str) -> None:
    write(tmp_path / "log")
    with pytest.raises(ConfigError) as caught:
        verify(tmp_path / "log", head=head)
    assert said(caught.value) == ("The head given is not a hash of 64 hexadecimal digits.", PRINTED)
    beside = head_path(tmp_path / "log")
    beside.write_text(head)
    with pytest.raises(ConfigError) as caught:
        verify(tmp_path / "log")
    assert said(caught.value) == (f"The head in {beside} is not a hash of 64 hexadecimal digits.", PRINTED)


def test_a_head_file_that_cannot_be_read_is_said_with_a_remedy(tmp_path: Path) -> None:
    beside = head_path(tmp_path / "log")
    beside.write_bytes(b"\xe9")
    with pytest.raises(DataError) as caught:
        read_head(tmp_path / "log")
    message, hint = said(caught.value)
    assert message.startswith(f"The head file {beside} cannot be read: 'ascii' codec can't decode byte 0xe9")
    assert hint == "Remove it, or restore it."


# Personal texts --------------------------------------------------------------------------------------------------


def test_withheld_texts_are_counted(tmp_path: Path) -> None:
    for key, held in ((None, 14), (KEY, 14)):
        path = tmp_path / f"log {key is None}"
        write(path, key=key, private=True)
        assert verify(path, key=key).withheld == held
    write(tmp_path / "open")
    assert verify(tmp_path / "open").withheld == 0


# Lines as they are written -----------------------------------------------------------------------------------------


def test_there_is_one_written_form() -> None:
    assert canonical({"b": [1, 2.5, None, True], "a": "é"}) == b'{"a":"\\u00e9","b":[1,2.5,null,true]}'
    with pytest.raises(ValueError, match="not JSON compliant"):
        canonical(float("nan"))


def test_what_json_lacks_is_stored_in_words() -> None:
    odd = {1: float("nan"), "a": (float("inf"), [float("-inf"), {None: 0.5}]), "b": 7}
    assert storable(odd) == {"1": "NaN", "a": ["Infinity", ["-Infinity", {"None": 0.5}]], "b": 7}


def test_a_line_can_be_told_to_the_byte() -> None:
    core = b'{"body":{"n":1},"kind":"wish","prev":"00","seq":3,"time":"now"}'
    digest = hashlib.sha256(core).hexdigest()
    line, head = seal(3, "00", "wish", "now", {"n": 1}, {}, None)
    assert head == digest
    assert line == b'{"body":{"n":1},"hash":"%s","kind":"wish","prev":"00","seq":3,"time":"now"}\n' % digest.encode()
    mac = hmac.new(KEY, b"chauffeur-audit-record-1\0" + core, "sha256").hexdigest()
    sealed = b'{"body":{"n":1},"kind":"wish","mac":"%s","prev":"00","seq":3,"time":"now"}' % mac.encode()
    line, head = seal(3, "00", "wish", "now", {"n": 1}, {"person": {"redacted": True}}, KEY)
    assert head == hashlib.sha256(sealed).hexdigest()
    record = parse(line[:-1])
    assert record == AuditRecord(3, "now", "wish", {"n": 1}, "00", head, {"person": {"redacted": True}}, mac)
    assert content_hash(record) == head
    assert is_sealed_with(record, KEY) and not is_sealed_with(record, OTHER_KEY)
    assert content_hash(parse(seal(3, "00", "wish", "now", {"n": 1}, {}, None)[0][:-1])) == digest


FIELDS = {"body": {}, "hash": "h", "kind": "wish", "prev": "p", "seq": 0, "time": "t"}


@pytest.mark.parametrize("seq", [0, (1 << 63) - 1])
def test_a_bare_record_has_no_texts_and_no_seal(seq: int) -> None:
    assert parse(canonical(FIELDS | {"seq": seq})) == AuditRecord(seq, "t", "wish", {}, "p", "h", {}, "")


# Personal texts as they are stored ---------------------------------------------------------------------------------


SALT = bytes(range(16))


def hidden(text: str, *, private: bool, key: bytes | None) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    return hide({"wish": text}, private=private, key=key, make_salt=lambda length: SALT[:length])


def recorded(references: object, texts: dict[str, dict[str, Any]]) -> AuditRecord:
    return AuditRecord(0, WHEN, "wish", {"texts": references}, "", "", texts)


WORDS = "Ü\ud800"
RAW = WORDS.encode("utf-8", "surrogatepass")
MAC = hmac.new(KEY, b"chauffeur-audit-text-1\0" + SALT + RAW, "sha256").hexdigest()


def test_how_texts_are_stored() -> None:
    digest = hashlib.sha256(SALT + b"text\0" + RAW).hexdigest()
    for key in (None, KEY):
        assert hidden(WORDS, private=False, key=key) == (
            {"wish": {"digest": digest}},
            {"wish": {"salt": SALT.hex(), "text": WORDS}},
        )
    digest = hashlib.sha256(SALT + b"hmac\0" + MAC.encode()).hexdigest()
    assert hidden(WORDS, private=True, key=KEY) == (
        {"wish": {"digest": digest}},
        {"wish": {"salt": SALT.hex(), "hmac": MAC}},
    )
    assert hidden(WORDS, private=True, key=None) == ({"wish": {"withheld": True}}, {})
    assert hide({"a": "1", "b": "2"}, private=True, key=None, make_salt=bytes) == (
        {"a": {"withheld": True}, "b": {"withheld": True}},
        {},
    )


@pytest.mark.parametrize(
    ("private", "key", "state", "shown"),
    [
        (False, None, TextState("wish", "stored", WORDS), WORDS),
        (False, KEY, TextState("wish", "stored", WORDS), WORDS),
        (True, KEY, TextState("wish", "digest"), "[digest only]"),
        (True, None, TextState("wish", "withheld"), "[withheld]"),
    ],
)
def test_how_stored_texts_stand(private: bool, key: bytes | None, state: TextState, shown: str) -> None:
    record = recorded(*hidden(WORDS, private=private, key=key))
    assert list(states(record)) == [state]
    assert words_of(record) == {"wish": shown}
    assert says(record, "wish", WORDS) is (True if not private else None)
    assert says(record, "wish", "other") is (False if not private else None)
    assert says(record, "wish", WORDS, KEY) is (None if private and key is None else True)
    assert says(record, "wish", "other", KEY) is (None if private and key is None else False)
    assert says(record, "person", WORDS, KEY) is None


REFERENCES, VALUES = hidden("faster", private=False, key=None)
DIGEST = REFERENCES["wish"]["digest"]


@pytest.mark.parametrize(
    ("references", "texts", "state"),
    [
        (REFERENCES, {"wish": {"redacted": True}}, TextState("wish", "redacted")),
        (REFERENCES, {"wish": {"redacted": 1}}, TextState("wish", "text_changed")),
        (REFERENCES, {"wish": {"redacted": True, "x": 1}}, TextState("wish", "text_changed")),
        (REFERENCES, {}, TextState("wish", "text_removed")),
        ({}, VALUES, TextState("wish", "text_added")),
        ([], VALUES, TextState("wish", "text_added")),
        ({"wish": {"withheld": True}}, VALUES, TextState("wish", "text_added")),
        ({"wish": {"withheld": True}}, {}, TextState("wish", "withheld")),
        ({"wish": {"digest": DIGEST, "x": 1}}, VALUES, TextState("wish", "text_changed")),
        ({"wish": None}, VALUES, TextState("wish", "text_changed")),
        *(
            (REFERENCES, {"wish": VALUES["wish"] | changed}, TextState("wish", "text_changed"))
            for changed in (
                {"text": "slower"}, {"text": 1}, {"salt": "zz"}, {"salt": SALT.hex().upper()}, {"salt": ""},
                {"more": ""}, {"salt": 7}, {"salt": f"{SALT.hex()} "}, {"hmac": "faster"},
            )
        ),
    ],
)  # fmt: skip
def test_how_tampered_texts_stand(references: object, texts: dict[str, dict[str, Any]], state: TextState) -> None:
    record = recorded(references, texts)
    assert list(states(record)) == [state]
    assert says(record, "wish", "faster") is None
    shown = {"redacted": "[redacted]", "withheld": "[withheld]"}
    assert words_of(record) == {"wish": shown.get(state.state, "[does not fit its digest]")}


def test_a_salt_that_is_none_fits_no_digest() -> None:
    """Not even the digest of the words without a salt, which anybody can compute."""
    digest = hashlib.sha256(b"text\0faster").hexdigest()
    record = recorded({"wish": {"digest": digest}}, {"wish": {"salt": "zz", "text": "faster"}})
    assert [one.state for one in states(record)] == ["text_changed"]


def test_erasing_leaves_no_text_of_a_record() -> None:
    record = recorded({}, {"wish": {"salt": "00", "text": "a"}, "person": {"salt": "00", "text": "b"}})
    assert erased(record) == {"wish": {"redacted": True}, "person": {"redacted": True}}


def test_a_record_without_texts_says_nothing() -> None:
    record = AuditRecord(0, WHEN, "wish", {}, "", "", {})
    assert list(states(record)) == [] and words_of(record) == {} and says(record, "wish", "") is None


# Erasing -----------------------------------------------------------------------------------------------------------


def in_vienna() -> datetime:
    return datetime(2026, 7, 8, 11, 10, 11, 12_345, tzinfo=timezone(timedelta(hours=2)))


@pytest.mark.parametrize("key", [None, KEY], ids=["plain", "keyed"])
@pytest.mark.parametrize("torn", [b"", b'{"body":{"to the clinic'], ids=["whole", "torn"])
def test_what_erasing_leaves(tmp_path: Path, key: bytes | None, torn: bytes) -> None:
    path = tmp_path / "log"
    closing = write(path, key=key)
    before = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(before) + torn)
    with far_east():
        done = redact(path, PersonId("ana"), key=key, clock=in_vienna)
    after = path.read_bytes().splitlines(keepends=True)
    assert (done.records, done.texts, done.head) == (4, 7, fields(after[-1])["hash"])
    left = read_head(path)
    assert left is not None
    assert (left.hash, left.records, left.closed) == (done.head, None if key is None else 15, True)
    for number, (old, new) in enumerate(zip(before, after[:-1], strict=True)):
        if number in (1, 2, 3, 6):
            kept = fields(old)
            assert fields(new) == kept | {"texts": {name: {"redacted": True} for name in kept["texts"]}}
        else:
            assert new == old
    last = parse(after[-1][:-1])
    assert (last.seq, last.prev, last.kind, last.time) == (
        14,
        closing.head,
        "redaction",
        "2026-07-08T09:10:11.012+00:00",
    )
    said_of_it = {"torn_bytes": len(torn), "torn_sha256": hashlib.sha256(torn).hexdigest()} if torn else {}
    assert last.body == {"records": [1, 2, 3, 6], "redacted_texts": 7, **said_of_it}
    assert bool(last.mac) is (key is not None)
    assert verify(path, key=key, head=closing.head).ok
    assert redact(path, PersonId("ana"), key=key) == Redaction(0, 0, done.head)
    assert redact(path, PersonId("eve"), key=key) == Redaction(0, 0, done.head)


def test_why_nothing_was_erased_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log"
    write(path, key=KEY)
    with pytest.raises(ConfigError) as caught:
        redact(path, PersonId("ana"))
    assert said(caught.value) == (f"The audit log {path} has a key, which erasing needs.", "Give it with --key FILE.")
    content = path.read_bytes()
    with monkeypatch.context() as patch:
        for error, why in ((OSError(errno.EIO, "broken"), "broken"), (OSError("no medium"), "no medium")):
            patch.setattr(redaction, "replace_whole", refusing(error))
            with pytest.raises(DataError) as caught:
                redact(path, PersonId("ana"), key=KEY)
            assert said(caught.value) == (f"The audit log {path} cannot be written: {why}. Nothing was erased.", "")
    head_path(path).unlink()
    path.write_bytes(content[: content.index(b"\n") + 1] + content)
    with pytest.raises(DataError) as caught:
        redact(path, PersonId("ana"), key=KEY)
    first = "line 2: record 0 (opened) stands here, where record 1 belongs."
    assert said(caught.value) == (
        f"The audit log {path} is not as it was written ({first}); nothing was erased.",
        f"Look at it with: chauffeur audit verify {path}",
    )
