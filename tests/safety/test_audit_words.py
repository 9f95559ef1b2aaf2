"""What is said of an audit log, word by word, for each thing that can be wrong with one, with its key or its head."""

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
from audit_logs import KEY, OTHER_KEY, far_east, fields, look, write

from chauffeur.concept import ConfigError, DataError, PersonId
from chauffeur.safety.audit import (
    Kind,
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
    NO_RECORD,
    AuditRecord,
    NotARecordError,
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

Told = list[tuple[int | None, str]]


def chain(*records: tuple[Kind, dict[str, Any]], key: bytes | None = None) -> list[bytes]:
    """Lines of a log in which every hash is right."""
    before, written = NO_RECORD, list[bytes]()
    for seq, (kind, body) in enumerate(records):
        line, before = seal(seq, before, kind, WHEN, body, {}, key)
        written.append(line)
    return written


OPENED: tuple[Kind, dict[str, Any]] = ("opened", {"format": 1, "key": ""})
WISH: tuple[Kind, dict[str, Any]] = ("wish", {})
CLOSED: tuple[Kind, dict[str, Any]] = ("closed", {})


def told(content: bytes, head: str | None = None, key: bytes | None = None) -> Told:
    return [(one.line, one.what) for one in look(content, head=head, key=key).findings]


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
    first, second = chain(OPENED, WISH)
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


def test_a_head_that_is_in_the_log_no_more_is_said_of_the_log_as_a_whole() -> None:
    head = "e" * 64
    (line, what), *more = told(b"".join(chain(OPENED, WISH, CLOSED)), head=head)
    assert not more
    assert (line, what) == (
        None,
        f"no record with the head {head} is in the log: its end was cut off, or it was written anew.",
    )


def test_records_behind_the_head_are_counted() -> None:
    written = chain(OPENED, WISH, WISH, CLOSED)
    heads = [fields(line)["hash"] for line in written]
    assert [look(b"".join(written), head=head).after_head for head in heads] == [3, 2, 1, 0]
    assert look(b"".join(written)).after_head is None


def test_a_head_is_not_found_in_a_record_that_does_not_fit() -> None:
    """Else a log with anything in it would pass whose last record only states the hash."""
    written = chain(OPENED, WISH, CLOSED)
    forged = fields(written[2])
    forged["body"] = {"forged": 1}
    found = look(b"".join([*written[:2], canonical(forged) + b"\n"]), head=forged["hash"])
    assert found.after_head is None
    assert [one.line for one in found.findings] == [3, None]


# The whole of a log ------------------------------------------------------------------------------------------------


def test_an_untouched_log_in_figures() -> None:
    gap: tuple[Kind, dict[str, Any]] = ("gap", {"lost": {"actuation": 3, "wish": 2}})
    found = look(b"".join(chain(OPENED, gap, WISH, gap, CLOSED)) + b"torn")
    assert (found.ok, found.findings, found.more_findings) == (True, (), 0)
    assert (found.records, found.kinds) == (5, {"opened": 1, "gap": 2, "wish": 1, "closed": 1})
    assert (found.torn_bytes, found.redacted, found.withheld, found.lost) == (4, 0, 0, 10)
    assert (found.closed, found.key, found.after_head) == (False, "none", None)
    assert look(b"".join(chain(OPENED, CLOSED))).closed


@pytest.mark.parametrize(("last", "closed"), [("closed", True), ("redaction", True), ("wish", False), ("gap", False)])
def test_whether_a_log_was_closed(last: Kind, closed: bool) -> None:
    """Erasing goes on after the closing, and nothing else does."""
    assert look(b"".join(chain(OPENED, CLOSED, (last, {})))).closed is closed
    assert look(b"".join(chain(OPENED, WISH, ("redaction", {})))).closed is False


@pytest.mark.parametrize(("lost", "counted"), [({}, 0), ({"wish": "2", "plan": 1}, 1), ([3], 0), (None, 0), (7, 0)])
def test_a_gap_counts_what_is_a_number(lost: object, counted: int) -> None:
    assert look(b"".join(chain(OPENED, ("gap", {"lost": lost})))).lost == counted
    assert look(b"".join(chain(OPENED, ("gap", {})))).lost == 0


def test_an_empty_log_holds_no_record() -> None:
    found = look(b"")
    assert [str(one) for one in found.findings] == ["the log holds no record."]
    assert (found.records, found.head, found.closed, found.key) == (0, "0" * 64, False, "none")
    assert [str(one) for one in look(b"torn").findings] == ["the log holds no record."]


def test_a_file_without_a_record_is_no_log(tmp_path: Path) -> None:
    (tmp_path / "notes").write_text("Dear diary\n")
    with pytest.raises(DataError) as caught:
        verify(tmp_path / "notes")
    words = " is not an audit log: none of its lines is a record."
    assert said(caught.value) == (f"{tmp_path / 'notes'}{words}", WRITE_ONE)
    with pytest.raises(DataError) as caught:
        look(b"Dear diary\n")
    assert said(caught.value) == (f"the log{words}", WRITE_ONE)


def test_a_newer_format_asks_for_a_newer_chauffeur() -> None:
    with pytest.raises(DataError) as caught:
        look(chain(("opened", {"format": 3}))[0])
    assert said(caught.value) == (
        "the log has audit format 3; this Chauffeur reads up to 2.",
        "Upgrade: pip install -U chauffeur",
    )


@pytest.mark.parametrize("first", [("opened", {"format": 0}), ("opened", {"format": "3"}), ("wish", {"format": 3})])
def test_only_an_opening_record_says_the_format(first: tuple[Kind, dict[str, Any]]) -> None:
    assert look(chain(first)[0]).records == 1


def test_a_changed_record_cannot_make_a_log_unreadable() -> None:
    changed = fields(chain(OPENED)[0])
    changed["body"]["format"] = 3
    assert told(canonical(changed) + b"\n") == [
        (1, "record 0 (opened) was changed: its content does not give its hash.")
    ]


def test_a_hundred_findings_are_kept_in_words() -> None:
    for junk, kept, more in ((99, 99, 0), (100, 100, 0), (101, 100, 1)):
        found = look(chain(OPENED)[0] + b"junk\n" * junk)
        assert (len(found.findings), found.more_findings) == (kept, more)


# Lines -------------------------------------------------------------------------------------------------------------


def test_a_line_that_is_no_record_is_said_and_the_next_one_not_held_to_it() -> None:
    written = chain(OPENED, WISH, WISH, CLOSED)
    assert told(b"".join([written[0], b"[]\n", written[2], written[3]])) == [(2, "it is not a record in JSON.")]
    assert told(b"".join([b"{}\n", *written[1:]])) == [(1, "it has not the fields of a record.")]


def test_what_stands_after_a_line_that_is_no_record_is_tied_again() -> None:
    written = chain(OPENED, WISH, WISH, WISH, CLOSED)
    assert told(b"".join([written[0], b"[]\n", written[2], written[4]])) == [
        (2, "it is not a record in JSON."),
        (4, "record 4 (closed) stands here; record 3 is not where it belongs."),
    ]


def test_a_removed_beginning_is_said() -> None:
    written = chain(OPENED, WISH, CLOSED)
    assert told(b"".join(written[1:])) == [(1, "the log begins with record 1 (wish): its beginning was removed.")]


def test_missing_records_are_named() -> None:
    written = chain(OPENED, WISH, ("plan", {}), ("verdict", {}), CLOSED)
    assert told(b"".join([*written[:1], *written[2:]])) == [
        (2, "record 2 (plan) stands here; record 1 is not where it belongs.")
    ]
    assert told(b"".join([*written[:1], *written[4:]])) == [
        (2, "record 4 (closed) stands here; records 1 to 3 are not where it belongs.")
    ]
    assert told(b"".join([written[0], written[2], written[1], written[3], written[4]])) == [
        (2, "record 2 (plan) stands here; record 1 is not where it belongs."),
        (3, "record 1 (wish) stands here, where record 3 belongs."),
        (4, "record 3 (verdict) stands here; record 2 is not where it belongs."),
    ]


def test_a_record_of_another_chain_is_said() -> None:
    written, other = chain(OPENED, WISH, CLOSED), chain(OPENED, ("wish", {"other": 1}), CLOSED)
    assert told(b"".join([*written[:2], other[2]])) == [
        (
            3,
            "record 2 (closed) was not written after the record before it: one of them was exchanged or changed.",
        )
    ]


def test_a_changed_record_is_said() -> None:
    written = chain(OPENED, WISH, CLOSED)
    changed = fields(written[1])
    changed["body"] = {"changed": 1}
    assert told(b"".join([written[0], canonical(changed) + b"\n", written[2]])) == [
        (2, "record 1 (wish) was changed: its content does not give its hash.")
    ]


# Keys of logs ------------------------------------------------------------------------------------------------------


def keyed(key: bytes) -> list[bytes]:
    return chain(("opened", {"format": 1, "key": key_name(key)}), WISH, CLOSED, key=key)


def test_a_log_with_a_key() -> None:
    content = b"".join(keyed(KEY))
    assert [look(content).key, look(content, key=KEY).key] == ["unchecked", "checked"]
    assert look(content).ok and look(content, key=KEY).ok


def test_a_key_for_a_log_without_one_is_said() -> None:
    assert told(b"".join(chain(OPENED, WISH)), key=KEY) == [
        (1, "the log was written without a key, and a key was given.")
    ]
    assert look(b"".join(chain(OPENED, WISH)), key=KEY).key == "none"


def test_another_key_is_said_once() -> None:
    assert told(b"".join(keyed(KEY)), key=OTHER_KEY) == [
        (1, f"the log was written under the key {key_name(KEY)}, and the key given is {key_name(OTHER_KEY)}.")
    ]


def test_a_seal_of_another_key_is_said_of_each_record() -> None:
    forged = chain(("opened", {"format": 1, "key": key_name(KEY)}), WISH, key=OTHER_KEY)
    assert told(b"".join(forged), key=KEY) == [
        (1, "record 0 (opened) was not written with this key."),
        (2, "record 1 (wish) was not written with this key."),
    ]
    assert told(b"".join(forged)) == []


def test_a_seal_that_is_missing_or_too_many_is_said() -> None:
    lacking = chain(("opened", {"format": 1, "key": key_name(KEY)}), WISH)
    assert told(b"".join(lacking), key=KEY) == [
        (1, "record 0 (opened) lacks a seal of the key."),
        (2, "record 1 (wish) lacks a seal of the key."),
    ]
    extra = chain(("opened", {"format": 1}), WISH, key=KEY)
    assert told(b"".join(extra)) == [
        (1, "record 0 (opened) has a seal of the key."),
        (2, "record 1 (wish) has a seal of the key."),
    ]


def test_without_its_beginning_a_log_is_known_to_have_a_key_by_its_seals() -> None:
    begun = (1, "the log begins with record 1 (wish): its beginning was removed.")
    rest = b"".join(keyed(KEY)[1:])
    assert told(rest, key=KEY) == [begun]
    assert told(rest, key=OTHER_KEY) == [
        begun,
        (1, "record 1 (wish) was not written with this key."),
        (2, "record 2 (closed) was not written with this key."),
    ]
    assert look(rest).key == "unchecked"


# Personal texts ----------------------------------------------------------------------------------------------------


def test_texts_that_do_not_fit_are_said_of_their_record(tmp_path: Path) -> None:
    write(tmp_path / "log")
    written = (tmp_path / "log").read_bytes().splitlines(keepends=True)
    wish = fields(written[1])
    wish["texts"]["more"] = wish["texts"].pop("wish")
    wish["texts"]["person"]["text"] = "eve"
    written[1] = canonical(wish) + b"\n"
    assert told(b"".join(written)) == [
        (2, "record 1 (wish): its text 'more' was added."),
        (2, "record 1 (wish): its text 'person' was changed."),
        (2, "record 1 (wish): its text 'wish' was removed."),
    ]


def test_erased_texts_are_counted_and_must_be_announced(tmp_path: Path) -> None:
    write(tmp_path / "log")
    written = (tmp_path / "log").read_bytes().splitlines(keepends=True)
    for number in (1, 2, 3):
        record = fields(written[number])
        record["texts"] = {name: {"redacted": True} for name in record["texts"]}
        written[number] = canonical(record) + b"\n"
    found = look(b"".join(written))
    assert found.redacted == 6
    words = "a personal text of record {} was erased, and no redaction record says so."
    assert [(one.line, one.what) for one in found.findings] == [(n + 1, words.format(n)) for n in (1, 2, 3)]
    line, _ = seal(found.records, found.head, "redaction", WHEN, {"records": [1, 3]}, {}, None)
    assert told(b"".join([*written, line])) == [(3, words.format(2))]


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


@pytest.mark.parametrize(
    ("line", "why"),
    [
        (b"", "it is not a record in JSON"),
        (b"\xff", "it is not a record in JSON"),
        (b"[]", "it is not a record in JSON"),
        (b"[" * 100_000, "it is not a record in JSON"),
        (b"{}", "it has not the fields of a record"),
        (canonical(FIELDS).replace(b'"hash":"h",', b""), "it has not the fields of a record"),
        (canonical(FIELDS | {"more": 1}), "it has not the fields of a record"),
        (canonical(FIELDS) + b" ", "it is not written the way Chauffeur writes a record"),
        (canonical(FIELDS | {"seq": 7}).replace(b"7", b"NaN"), "it is not written the way Chauffeur writes a record"),
        *(
            (canonical(FIELDS | changed), "its fields are not of the kinds a record has")
            for changed in (
                {"seq": True}, {"seq": -1}, {"seq": 1 << 63}, {"seq": 1.0}, {"kind": "plans"}, {"body": []},
                {"texts": []}, {"texts": {"a": "b"}}, {"texts": {"a": {}, "b": 1}}, {"time": 1}, {"prev": None},
                {"hash": 2}, {"mac": 3},
            )
        ),
    ],
)  # fmt: skip
def test_why_a_line_is_no_record_is_said(line: bytes, why: str) -> None:
    with pytest.raises(NotARecordError) as caught:
        parse(line)
    assert str(caught.value) == why


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
        (REFERENCES, {"wish": {"redacted": 1}}, TextState("wish", "wrong", "its text 'wish' was changed")),
        (REFERENCES, {"wish": {"redacted": True, "x": 1}}, TextState("wish", "wrong", "its text 'wish' was changed")),
        (REFERENCES, {}, TextState("wish", "wrong", "its text 'wish' was removed")),
        ({}, VALUES, TextState("wish", "wrong", "its text 'wish' was added")),
        ([], VALUES, TextState("wish", "wrong", "its text 'wish' was added")),
        ({"wish": {"withheld": True}}, VALUES, TextState("wish", "wrong", "its text 'wish' was added")),
        ({"wish": {"withheld": True}}, {}, TextState("wish", "withheld")),
        ({"wish": {"digest": DIGEST, "x": 1}}, VALUES, TextState("wish", "wrong", "its text 'wish' was changed")),
        ({"wish": None}, VALUES, TextState("wish", "wrong", "its text 'wish' was changed")),
        *(
            (REFERENCES, {"wish": VALUES["wish"] | changed}, TextState("wish", "wrong", "its text 'wish' was changed"))
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
    shown = {"redacted": "[redacted]", "wrong": "[does not fit its digest]", "withheld": "[withheld]"}
    assert words_of(record) == {"wish": shown[state.state]}


def test_a_salt_that_is_none_fits_no_digest() -> None:
    """Not even the digest of the words without a salt, which anybody can compute."""
    digest = hashlib.sha256(b"text\0faster").hexdigest()
    record = recorded({"wish": {"digest": digest}}, {"wish": {"salt": "zz", "text": "faster"}})
    assert [one.state for one in states(record)] == ["wrong"]


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
