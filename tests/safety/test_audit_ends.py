"""Under a key, the end of a log cannot be cut off unseen: the head beside it is sealed, with the count of records."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from audit_logs import ABOUT, KEY, OTHER_KEY, fields, old_log, ticking, write
from golden_sentences import compare

from chauffeur.concept import ConfigError, DataError, PersonId
from chauffeur.safety.audit import AuditLog, head_path, redact, redaction, verify
from chauffeur.safety.audit.heads import Head, leave_head, read_head


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A log of three drives, under a key."""
    path = tmp_path / "log"
    for _ in range(3):
        write(path, key=KEY)
    return path


def said(path: Path, key: bytes = KEY) -> list[str]:
    return [finding.code for finding in verify(path, key=key).findings]


def lines_of(path: Path) -> list[bytes]:
    return path.read_bytes().splitlines(keepends=True)


def cut(path: Path, records: int) -> str:
    """Keep that many records; the hash of the last one."""
    lines = lines_of(path)[:records]
    path.write_bytes(b"".join(lines))
    return str(fields(lines[-1])["hash"])


def open_log(path: Path) -> AuditLog:
    return AuditLog(path, about=ABOUT, clock=ticking(), key=KEY)


def crashed(path: Path) -> Path:
    """A log whose writer was killed: two records on the disk, and the head as it was at the opening."""
    log = open_log(path)
    log.append("wish", {"source": "text"})
    assert log.flush()
    content, head = path.read_bytes(), head_path(path).read_bytes()
    log.close()
    path.write_bytes(content)
    head_path(path).write_bytes(head)
    return path


def test_a_whole_log_is_said_to_be_whole(path: Path) -> None:
    found = verify(path, key=KEY)
    assert (found.ok, found.end, found.after_head, found.unclosed) == (True, "whole", 0, 0)
    assert verify(path).end == "unknown"
    head = read_head(path)
    assert head is not None
    assert (head.hash, head.records, head.closed) == (found.head, found.records, True)


def test_every_cut_is_found_whatever_is_done_to_the_head(path: Path) -> None:
    whole, sealed = path.read_bytes(), head_path(path).read_bytes()
    records = len(lines_of(path))
    closings = [number for number, line in enumerate(lines_of(path), 1) if fields(line)["kind"] == "closed"]
    assert len(closings) == 3
    for kept in range(1, records):
        path.write_bytes(whole)
        last = cut(path, kept)
        forged = json.loads(sealed) | {"hash": last, "records": kept}
        for head in (
            sealed,
            None,
            f"{last}\n".encode(),  # as it was before heads were sealed: a cut at an earlier "closed" then verified
            json.dumps(forged).encode(),
            json.dumps(forged | {"closed": False}).encode(),
            json.dumps(forged | {"mac": ""}).encode(),
        ):
            head_path(path).unlink(missing_ok=True)
            if head is not None:
                head_path(path).write_bytes(head)
            found = verify(path, key=KEY)
            assert (found.ok, found.end) == (False, "doubtful"), (kept, head)
            with pytest.raises(DataError, match="is not continued"):
                open_log(path)
            with pytest.raises(DataError, match="nothing was erased"):
                redact(path, PersonId("ana"), key=KEY)


def test_what_is_wrong_with_an_end_is_said(path: Path) -> None:
    head, open_end = head_path(path), crashed(path.with_name("open"))
    sealed = head.read_bytes()
    before = json.loads(sealed)
    found: dict[str, list[object]] = {}

    def is_said(*codes: str, of: Path = path) -> None:
        findings = verify(of, key=KEY).findings
        assert tuple(one.code for one in findings) == codes
        found.update({one.code: [one] for one in findings if one.line is None and one.code != "head_absent"})

    head.unlink()
    is_said("headfile_missing")
    leave_head(path, before["hash"], before["records"], key=OTHER_KEY)
    is_said("headfile_unsealed")
    head.write_bytes(f"{before['hash']}\n".encode())
    is_said("headfile_unsealed")
    leave_head(path, fields(lines_of(path)[4])["hash"], 5, key=KEY)
    is_said("headfile_other")
    head.write_bytes(sealed)
    last = cut(path, 5)
    is_said("head_absent", "end_cut")
    is_said("end_open", of=open_end)
    compare("audit: ends", found)
    assert verify(path, key=KEY, head=last).end == "whole", "a head that was kept elsewhere vouches, too"


@pytest.mark.parametrize(
    "content", ["{", "[]", "{}", '{"hash": 1}', '{"closed": 1, "hash": "", "mac": "", "records": 0}', "[" * 9999]
)
def test_a_damaged_head_is_said(path: Path, content: str) -> None:
    head_path(path).write_text(content)
    with pytest.raises(DataError if content.startswith("{") else Exception, match=r"damaged|not a hash"):
        verify(path, key=KEY)


def test_a_log_that_was_not_closed_is_said_gone_on_with_and_said_for_ever(tmp_path: Path) -> None:
    path = crashed(tmp_path / "log")
    found = verify(path, key=KEY)
    assert (found.ok, found.usable, found.end, found.closed) == (False, True, "open", False)
    open_log(path).close()
    found = verify(path, key=KEY)
    assert (found.ok, found.end, found.unclosed) == (True, "whole", 1)
    assert [fields(line)["body"].get("unclosed") for line in lines_of(path)] == [None, None, True, None]


def test_in_a_log_that_was_not_closed_what_stood_before_cannot_be_cut(path: Path) -> None:
    records = len(lines_of(path))
    crashed(path)
    assert verify(path, key=KEY).end == "open"
    cut(path, records - 1)
    found = verify(path, key=KEY)
    assert (found.end, found.usable) == ("doubtful", False)


def test_a_closed_log_is_not_passed_off_as_crashed_without_being_said(tmp_path: Path) -> None:
    """By the head of another log's opening, under the same key."""
    crashed(tmp_path / "other")
    write(tmp_path / "log", key=KEY)
    cut(tmp_path / "log", 3)
    head_path(tmp_path / "log").write_bytes(head_path(tmp_path / "other").read_bytes())
    assert not verify(tmp_path / "log", key=KEY).ok


@pytest.mark.parametrize("was_closed", [True, False])
def test_erasing_keeps_what_is_known_of_the_end(tmp_path: Path, was_closed: bool) -> None:
    path = tmp_path / "log"
    write(path, key=KEY)
    if not was_closed:
        crashed(path)
    assert redact(path, PersonId("ana"), key=KEY).texts == 7
    found = verify(path, key=KEY)
    assert (found.ok, found.end) == ((True, "whole") if was_closed else (False, "open"))
    assert redact(path, PersonId("ben"), key=KEY).texts == 7
    assert verify(path, key=KEY).end == found.end


def test_a_crash_while_erasing_leaves_a_log_that_goes_on(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def killed(*args: object) -> None:
        raise KeyboardInterrupt

    def killed_when_done(*args: Any, **kwargs: Any) -> None:
        if kwargs["closed"]:
            raise KeyboardInterrupt
        leave_head(*args, **kwargs)

    for place, death in (("replace_whole", killed), ("leave_head", killed_when_done)):
        with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
            patch.setattr(redaction, place, death)
            redact(path, PersonId("ana"), key=KEY)
        found = verify(path, key=KEY)
        assert (found.usable, found.end) == (True, "open"), place
        open_log(path).close()
    assert verify(path, key=KEY).ok


def test_a_log_of_the_old_format_is_read_and_under_a_key_not_gone_on_with(tmp_path: Path) -> None:
    plain, keyed = old_log(tmp_path / "plain", None), old_log(tmp_path / "keyed", KEY)
    assert verify(plain).ok
    found = verify(keyed, key=KEY)
    assert (found.ok, found.end, found.after_head) == (True, "unknown", 0)
    with AuditLog(plain, about={}):
        pass
    assert verify(plain).ok
    with pytest.raises(DataError, match="of format 1, whose end its key does not vouch for, so it is not continued"):
        open_log(keyed)
    assert verify(keyed, key=KEY).ok


def test_a_head_beside_a_log_is_read_without_its_line_end(tmp_path: Path) -> None:
    assert head_path(tmp_path / "log.jsonl") == tmp_path / "log.jsonl.head"
    assert read_head(tmp_path / "log") is None
    head_path(tmp_path / "log").write_text(f" {'0123456789abcdef' * 4}\n")
    assert read_head(tmp_path / "log") == Head("0123456789abcdef" * 4)


@pytest.mark.parametrize("head", ["", "a" * 63, "a" * 65, "A" * 64, "g" * 64, "X" * 64])
def test_what_is_no_head_is_said(tmp_path: Path, head: str) -> None:
    write(tmp_path / "log")
    with pytest.raises(ConfigError, match="The head given"):
        verify(tmp_path / "log", head=head)
    head_path(tmp_path / "log").write_text(head)
    with pytest.raises(ConfigError, match="The head in"):
        verify(tmp_path / "log")
