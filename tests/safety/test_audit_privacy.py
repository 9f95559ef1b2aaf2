"""A person's words: nothing of them where they are withheld, and nothing left of them where they were erased."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest
from audit_logs import KEY, OTHER_KEY, WISH, fields, look, ticking, write
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.concept import NOBODY, ConfigError, DataError, PersonId
from chauffeur.safety.audit import AuditLog, head_path, read_records, redact, says, verify, words_of

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


@pytest.mark.parametrize("key", [None, KEY], ids=["plain", "keyed"])
@pytest.mark.parametrize("private", [False, True], ids=["open", "private"])
def test_erasing_leaves_no_word_and_a_chain_that_holds(tmp_path: Path, key: bytes | None, private: bool) -> None:
    path = tmp_path / "audit.jsonl"
    before = write(path, key=key, private=private)
    hashes = [fields(line)["hash"] for line in path.read_bytes().splitlines()]
    done = redact(path, ANA, key=key, clock=ticking())
    if private and key is None:
        assert done.records == 0  # there is nothing that could be erased
        assert verify(path, head=before.head).after_head == 0
        return
    assert (done.records, done.texts) == (4, 7)
    content = path.read_text()
    assert "(ana)" not in content
    assert '"text":"ana"' not in content
    found = verify(path, head=before.head, key=key)
    assert found.ok, found.findings
    assert (found.redacted, found.after_head, found.head, found.closed) == (7, 1, done.head, True)
    assert hashes == [fields(line)["hash"] for line in path.read_bytes().splitlines()][:-1]
    assert of_kind(path, "wish")[0] == {"person": "[redacted]", "wish": "[redacted]"}
    if not private:
        assert of_kind(path, "wish")[1]["wish"] == f"{WISH} (ben)"
    assert (verify(path, key=key).after_head, verify(path, key=key).end) == (0, "unknown" if key is None else "whole")
    again = redact(path, ANA, key=key)
    assert (again.records, again.head) == (0, done.head)
    redact(path, BEN, key=key)
    assert verify(path, head=before.head, key=key).redacted == 14
    with AuditLog(path, about={}, key=key):
        pass
    assert verify(path, head=before.head, key=key).ok


def test_no_salt_is_left_to_try_words_on(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    write(path)
    salts = [
        text["salt"]
        for line in path.read_bytes().splitlines()
        if (texts := fields(line).get("texts", {})).get("person", {}).get("text") == "ana"
        for text in texts.values()
    ]
    assert len(salts) == 7
    redact(path, ANA)
    assert not [salt for salt in salts if salt in path.read_text()]


@given(
    st.sampled_from(["wish", "person"]),
    st.one_of(
        st.none(),
        st.just({"redacted": 1}),
        st.just({"redacted": True, "text": "x"}),
        st.just({"salt": "00", "text": "faster"}),
        st.just({"salt": "zz", "text": "faster"}),
        st.just({"salt": 1, "text": "faster"}),
        st.just({"salt": "00", "hmac": "0" * 64}),
        st.dictionaries(st.sampled_from(["salt", "text", "hmac", "redacted", "more"]), st.text(max_size=4)),
    ),
)
@settings(max_examples=80, deadline=None)
def test_exchanged_words_are_found(
    tmp_path_factory: pytest.TempPathFactory, name: str, value: dict[str, object] | None
) -> None:
    path = tmp_path_factory.mktemp("words") / "audit.jsonl"
    write(path)
    lines = path.read_bytes().splitlines(keepends=True)
    wish = fields(lines[1])
    if value is None:
        del wish["texts"][name]
    else:
        wish["texts"][name] = value
    lines[1] = json.dumps(wish, sort_keys=True, separators=(",", ":")).encode() + b"\n"
    found = look(b"".join(lines))
    assert [finding.line for finding in found.findings] == [2]
    path.write_bytes(b"".join(lines))
    record = next(record for number, record in read_records(path) if number == 2)
    assert says(record, name, "faster") is None
    assert words_of(record)[name] == "[does not fit its digest]"


def test_a_text_added_beside_a_record_is_found(tmp_path: Path) -> None:
    for private in (False, True):
        path = tmp_path / f"{private}.jsonl"
        write(path, private=private)
        lines = path.read_bytes().splitlines(keepends=True)
        wish = fields(lines[1])
        wish.setdefault("texts", {})["wish" if private else "more"] = {"salt": "00", "text": "drive into them"}
        lines[1] = json.dumps(wish, sort_keys=True, separators=(",", ":")).encode() + b"\n"
        found = look(b"".join(lines))
        assert [(finding.line, finding.code) for finding in found.findings] == [(2, "text_added")]


def test_what_cannot_be_erased_is_said_and_left_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    with pytest.raises(DataError, match="no audit log"):
        redact(path, ANA)
    assert not path.exists()
    write(path, key=KEY)
    content = path.read_bytes()
    with pytest.raises(ConfigError, match="has a key"):
        redact(path, ANA)
    with pytest.raises(DataError, match="nothing was erased"):
        redact(path, ANA, key=OTHER_KEY)
    with AuditLog(path, about={}, key=KEY) as log:
        assert log.flush()
        with pytest.raises(DataError, match="somebody else"):
            redact(path, ANA, key=KEY)
    path.write_bytes(content.replace(b"format-v1", b"format-v2", 1))
    head_path(path).unlink()
    with pytest.raises(DataError, match="nothing was erased"):
        redact(path, ANA, key=KEY)
    assert path.read_bytes() == content.replace(b"format-v1", b"format-v2", 1)


def test_words_in_a_torn_end_are_erased_too(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    write(path)
    torn = b'{"body":{"source":"text"},"texts":{"wish":"to the clinic'
    path.write_bytes(path.read_bytes() + torn)
    redact(path, ANA)
    assert b"clinic" not in path.read_bytes()
    found = verify(path)
    assert found.ok
    assert found.torn_bytes == 0
    last = [record for _, record in read_records(path)][-1]
    assert last.body["torn_bytes"] == len(torn)


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
