"""`chauffeur audit`: what it prints, what it finds, how it fails."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console
from typer.testing import CliRunner, Result

from chauffeur.cli.audit import auditor_for, tell_closing
from chauffeur.cli.main import app
from chauffeur.concept import ConfigError, Instruction, PersonId
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.scenarios import find
from chauffeur.safety.audit import AuditLog, Closing, head_path

KEY = b"a key of thirty-two bytes, quite"
COMMANDS = ["verify", "redact"]


def invoke(*arguments: object, answer: str = "") -> Result:
    return CliRunner().invoke(app, ["audit", *map(str, arguments)], input=answer)


def one_line(result: Result) -> str:
    return " ".join(result.output.split())


def write(path: Path, *, key: bytes | None = None, private: bool = False) -> str:
    log = AuditLog(path, about={"scenario": "cruise", "seed": 7, "simulated": True}, key=key, private=private)
    log.append("wish", {"source": "text"}, {"person": "ana", "wish": "=Faster, [bold]please[/]\x1b[2J 快点"})
    log.append("verdict", {"check": "format-v1", "passed": False, "line": 3}, {"person": "ana", "reason": "No loop."})
    for number in range(3):
        log.append("actuation", {"ticks": [number, number]})
    return log.close().head


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "audit.jsonl"
    write(path)
    return path


def tamper(path: Path) -> None:
    path.write_bytes(path.read_bytes().replace(b'"passed":false', b'"passed":true', 1))


def test_help_has_examples_everywhere() -> None:
    for command in ([], *([name] for name in COMMANDS)):
        result = invoke(*command, "--help")
        assert result.exit_code == 0
        assert "Examples:" in result.output
        assert "chauffeur audit" in result.output


def test_verify_says_what_it_looked_at_and_what_it_could_not_see(log: Path) -> None:
    result = invoke("verify", log)
    assert result.exit_code == 0
    text = one_line(result)
    assert "As it was written" in text
    assert "7 records" in text
    assert "the head is in the log; it is the last record" in text
    assert "whoever could write the file could have written it anew" in text
    head_path(log).unlink()
    assert "records cut off at the end would not be found" in one_line(invoke("verify", log))


def test_tampering_is_exit_code_1_with_line_and_words(log: Path) -> None:
    tamper(log)
    result = invoke("verify", log)
    assert result.exit_code == 1
    assert "Not as it was written" in result.output
    assert "line 3: record 2 (verdict) was changed" in one_line(result)


def test_a_cut_off_end_shows_against_the_head(log: Path) -> None:
    head = head_path(log).read_text().strip()
    head_path(log).unlink()
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join(lines[:-2]))
    assert invoke("verify", log).exit_code == 0
    assert "not closed" in invoke("verify", log).output
    result = invoke("verify", log, "--head", head)
    assert result.exit_code == 1
    assert "its end was cut off" in one_line(result)


def test_a_torn_end_is_no_tampering(log: Path) -> None:
    log.write_bytes(log.read_bytes() + b'{"body":{"half')
    result = invoke("verify", log)
    assert result.exit_code == 0
    assert "14 bytes of a record that was being written" in one_line(result)


def test_the_key_is_looked_at(tmp_path: Path) -> None:
    path, key, other = tmp_path / "audit.jsonl", tmp_path / "key", tmp_path / "other"
    key.write_bytes(KEY)
    other.write_bytes(KEY[::-1])
    write(path, key=KEY, private=True)
    assert "was not given" in one_line(invoke("verify", path))
    result = invoke("verify", path, "--key", key)
    assert result.exit_code == 0
    assert "every record was looked at under the key given" in one_line(result)
    assert "4 texts never written" in one_line(result)
    assert invoke("verify", path, "--key", other).exit_code == 1


def test_bad_input_is_exit_code_2_with_a_hint(log: Path, tmp_path: Path) -> None:
    notes = tmp_path / "notes.txt"
    notes.write_text("Dear diary,\n")
    bad = [
        ["verify", tmp_path / "absent"],
        ["verify", notes],
        ["verify", log, "--head", "5d1c"],
        ["verify", log, "--key", tmp_path / "absent"],
        ["redact", tmp_path / "absent", "--as", "ana", "--yes"],
    ]
    for arguments in bad:
        result = invoke(*arguments)
        assert result.exit_code == 2, arguments
        assert "Error:" in result.output
        assert "Traceback" not in result.output


def test_the_environment_names_key_and_privacy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    key, path = tmp_path / "key", tmp_path / "audit.jsonl"
    key.write_bytes(KEY)
    monkeypatch.setenv("CHAUFFEUR_AUDIT_KEY", str(key))
    monkeypatch.setenv("CHAUFFEUR_AUDIT_PRIVATE", "1")
    with auditor_for(path, find("cruise", None), 7) as auditor:
        auditor.tell(DriveEvent("wish", value=Instruction("Faster, please.", PersonId("ana"))))
    assert "Faster" not in path.read_text()
    assert "every record was looked at under the key given" in one_line(invoke("verify", path))
    monkeypatch.setenv("CHAUFFEUR_AUDIT_KEY", str(tmp_path / "absent"))
    with pytest.raises(ConfigError, match="cannot be read"):
        auditor_for(path, find("cruise", None), 7)
    monkeypatch.setenv("CHAUFFEUR_AUDIT_PRIVATE", "maybe")
    with pytest.raises(ConfigError, match="'maybe'"):
        auditor_for(path, find("cruise", None), 7)


def test_a_drive_ends_with_the_head_of_its_log(tmp_path: Path) -> None:
    console = Console(width=100, record=True, file=io.StringIO())
    tell_closing(console, tmp_path / "audit.jsonl", Closing("ab" * 32, 9, 0, ""))
    assert "ab" * 32 in console.export_text(clear=True)
    tell_closing(console, Path("/dev/full"), Closing("0" * 64, 0, 1, "The disk is full."))
    assert "The audit log is not complete: 1 record missing. The disk is full." in console.export_text()


def test_redact_asks_first_and_is_told_of_afterwards(log: Path) -> None:
    head = head_path(log).read_text().strip()
    assert invoke("redact", log, "--as", "ana", answer="n\n").exit_code == 1
    assert "please" in log.read_text()
    result = invoke("redact", log, "--as", "ana", answer="y\n")
    assert result.exit_code == 0
    assert "4 texts of 2 records erased" in one_line(result)
    assert "please" not in log.read_text()
    result = invoke("verify", log, "--head", head)
    assert result.exit_code == 0
    assert "4 texts redacted" in one_line(result)
    assert "1 record written after it" in one_line(result)
    assert "holds no words of 'ana'" in one_line(invoke("redact", log, "--as", "ana", "--yes"))
