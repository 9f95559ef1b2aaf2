"""Personal texts: nothing of them where they are withheld, nothing left where they were erased, tampering found."""

from __future__ import annotations

import hashlib
import hmac
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest
from audit_logs import KEY, OTHER_KEY, WISH, far_east, fields, ticking, write

from chauffeur.concept import NOBODY, DataError, PersonId
from chauffeur.safety.audit import AuditLog, read_records, redact, redaction, says, verify, words_of
from chauffeur.safety.audit.entries import AuditRecord, parse
from chauffeur.safety.audit.heads import read_head
from chauffeur.safety.audit.redaction import Redaction
from chauffeur.safety.audit.texts import TextState, hide, states

ANA, BEN = PersonId("ana"), PersonId("ben")


def of_kind(path: Path, kind: str) -> list[dict[str, str]]:
    return [words_of(record) for _, record in read_records(path) if record.kind == kind]


def test_privacy_mode_holds_nothing_of_the_words(tmp_path: Path) -> None:
    for key in (None, KEY):
        path = tmp_path / f"audit-{bool(key)}.jsonl"
        write(path, key=key, private=True)
        content = path.read_text()
        for word in ("berhol", "\\u5feb", "ana", "ben", "Three", "lanes"):
            assert word not in content, word
        found = verify(path, key=key)
        assert found.ok
        assert found.withheld == 14
        mark = "[digest only]" if key else "[withheld]"
        assert of_kind(path, "wish") == [{"person": mark, "wish": mark}] * 2


def test_a_digest_of_guessable_words_cannot_be_tried_without_the_key(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    write(path, key=KEY, private=True)
    wish = next(record for _, record in read_records(path) if record.kind == "wish")
    salt, digest = bytes.fromhex(str(wish.texts["person"]["salt"])), wish.body["texts"]["person"]["digest"]
    for form in (b"", b"text\0", b"hmac\0"):
        assert hashlib.sha256(salt + form + b"ana").hexdigest() != digest


def test_who_has_the_key_can_show_what_was_said(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    write(path, key=KEY, private=True)
    wish = next(record for _, record in read_records(path) if record.kind == "wish")
    assert says(wish, "wish", f"{WISH} (ana)", KEY) is True
    assert says(wish, "wish", f"{WISH} (ben)", KEY) is False
    assert says(wish, "wish", f"{WISH} (ana)", OTHER_KEY) is False
    assert says(wish, "wish", f"{WISH} (ana)") is None
    assert says(wish, "no such text", "x", KEY) is None


def test_where_nothing_was_kept_nothing_is_erased(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    closing = write(path, private=True)
    assert redact(path, ANA).records == 0
    assert verify(path, head=closing.head).after_head == 0


@pytest.mark.parametrize(("key", "private"), [(None, False), (KEY, False), (KEY, True)])
def test_after_erasing_the_chain_holds_and_goes_on(tmp_path: Path, key: bytes | None, private: bool) -> None:
    path = tmp_path / "audit.jsonl"
    before = write(path, key=key, private=private)
    done = redact(path, ANA, key=key, clock=ticking())
    found = verify(path, head=before.head, key=key)
    assert found.ok, found.findings
    assert (found.redacted, found.after_head, found.head, found.closed) == (7, 1, done.head, True)
    assert of_kind(path, "wish")[0] == {"person": "[redacted]", "wish": "[redacted]"}
    assert of_kind(path, "wish")[1]["wish"] == ("[digest only]" if private else f"{WISH} (ben)")
    assert (verify(path, key=key).after_head, verify(path, key=key).end) == (0, "unknown" if key is None else "whole")
    redact(path, BEN, key=key)
    assert verify(path, head=before.head, key=key).redacted == 14
    with AuditLog(path, about={}, key=key):
        pass
    assert verify(path, head=before.head, key=key).ok


def test_a_link_is_followed_to_the_words(tmp_path: Path) -> None:
    path, link = tmp_path / "audit.jsonl", tmp_path / "link"
    write(path)
    link.symlink_to(path)
    assert redact(link, ANA).texts == 7
    assert link.is_symlink()
    assert "(ana)" not in path.read_text()
    assert verify(path).ok


def test_wishes_without_a_name_can_be_erased(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    with AuditLog(path, about={}) as log:
        log.append("wish", {}, {"person": NOBODY, "wish": "faster"})
    assert redact(path, NOBODY).texts == 2
    assert b"faster" not in path.read_bytes()
    assert verify(path).ok


# Personal texts as they are stored ---------------------------------------------------------------------------------


SALT = bytes(range(16))


def hidden(text: str, *, private: bool, key: bytes | None) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    return hide({"wish": text}, private=private, key=key, make_salt=lambda length: SALT[:length])


def recorded(references: object, texts: dict[str, dict[str, Any]]) -> AuditRecord:
    return AuditRecord(0, "", "wish", {"texts": references}, "", "", texts)


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


def test_a_record_without_texts_says_nothing() -> None:
    record = AuditRecord(0, "", "wish", {}, "", "", {})
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
        done = redact(path, ANA, key=key, clock=in_vienna)
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
    assert redact(path, ANA, key=key) == Redaction(0, 0, done.head)
    assert redact(path, PersonId("eve"), key=key) == Redaction(0, 0, done.head)


def test_a_log_that_changes_while_it_is_erased_is_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log"
    write(path)

    def verified_then_spoilt(*args: Any, **options: Any) -> Any:
        found = verify(*args, **options)
        path.write_bytes(path.read_bytes().replace(b'{"body"', b'["body"', 1))
        return found

    monkeypatch.setattr(redaction, "verify", verified_then_spoilt)
    with pytest.raises(DataError, match="changed while it was read"):
        redact(path, ANA)
    assert path.read_bytes().startswith(b'["body"')
    assert b"ana" in path.read_bytes()
