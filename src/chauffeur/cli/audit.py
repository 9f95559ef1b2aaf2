"""`chauffeur audit`: check an audit log, look into it, hand it on, and erase a person's words from it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from chauffeur.cli.examples import help_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console

    from chauffeur.concept import Scenario
    from chauffeur.drive.session_recorder import DriveRecorder
    from chauffeur.safety.audit import AuditRecord, AuditVerification, Closing

KEY_VARIABLE: Final = "CHAUFFEUR_AUDIT_KEY"
"""Environment variable that names the key file."""

PRIVATE_VARIABLE: Final = "CHAUFFEUR_AUDIT_PRIVATE"
"""Environment variable that keeps a person's words out of audit logs when it is set to 1."""

audit_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Audit logs of drives: verify, show, export, redact.",
)

Log = Annotated[Path, typer.Argument(metavar="PATH", help="The audit log.")]
Key = Annotated[
    Path | None,
    typer.Option("--key", metavar="FILE", envvar=KEY_VARIABLE, help="Key that the log was written with."),
]

EXAMPLES = help_text("audit")

VERIFY_EXAMPLES = help_text("audit VERIFY_EXAMPLES")

SHOW_EXAMPLES = help_text("audit SHOW_EXAMPLES")

EXPORT_EXAMPLES = help_text("audit EXPORT_EXAMPLES")

REDACT_EXAMPLES = """
Examples:

    chauffeur audit redact trips/audit.jsonl --as ana
"""

_MOST_TEXT = 300
"""Characters of one text that the table shows; `export` gives all of them."""


@audit_app.callback(epilog=EXAMPLES)
def audit() -> None:
    """Audit logs of drives."""


@audit_app.command("verify", epilog=VERIFY_EXAMPLES)
def verify_log(
    path: Log,
    head: Annotated[
        str | None, typer.Option(metavar="HASH", help="Head printed when the log was closed; default the .head file's.")
    ] = None,
    key: Key = None,
) -> None:
    """Check that a log is as it was written: no record changed, removed, inserted or exchanged.

    Records cut off at the end show only against a head; a log written anew shows only against a key, or a head kept
    elsewhere.
    """
    from chauffeur.cli.console import stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.safety.audit import read_key, verify

    found = verify(path, head=head, key=None if key is None else read_key(key))
    _tell(stdout(), path, found)
    if not found.ok:
        raise typer.Exit(FAILED)


@audit_app.command("show", epilog=SHOW_EXAMPLES)
def show_log(
    path: Log,
    kind: Annotated[list[str] | None, typer.Option(help="Only this kind; may be given again.")] = None,
    first: Annotated[str, typer.Option("--from", metavar="WHEN", help="From this record number, or this time.")] = "",
    last: Annotated[str, typer.Option("--to", metavar="WHEN", help="To this record number, or this time.")] = "",
) -> None:
    """Show the records as a table. Exit code 1 says that the log is not as it was written."""
    from rich.table import Table

    from chauffeur.cli.console import plain, stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.safety.audit import verify

    found = verify(path)
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for name in ("no.", "time (UTC)", "kind", "what"):
        table.add_column(name, justify="right" if name == "no." else "left", no_wrap=name != "what", overflow="fold")
    for record in _chosen(path, kind, first, last):
        what = "\n".join((*_facts(record), *_texts(record)))
        table.add_row(str(record.seq), plain(record.time[:23].replace("T", " ")), record.kind, plain(what))
    console = stdout()
    console.print(table)
    _tell(console, path, found)
    if not found.ok:
        raise typer.Exit(FAILED)


@audit_app.command("export", epilog=EXPORT_EXAMPLES)
def export_log(
    path: Log,
    out: Annotated[Path, typer.Option(metavar="FILE", help="File to write: .jsonl or .csv.")],
    kind: Annotated[list[str] | None, typer.Option(help="Only this kind; may be given again.")] = None,
) -> None:
    """Write the records to a file for other programs, without salts and seals. It holds personal texts as they stand.

    Exit code 1 says that the log is not as it was written; the file is written nevertheless.
    """
    import csv
    import io
    import json

    from chauffeur.cli.console import path_text, stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.concept import ConfigError
    from chauffeur.drive.files import publish
    from chauffeur.safety.audit import verify, words_of

    if out.suffix not in (".jsonl", ".csv"):
        raise ConfigError(f"The export {out} is neither .jsonl nor .csv.", hint="Name a file with one of these ends.")
    if out.resolve() == path.resolve():
        raise ConfigError("The export would replace the log itself.", hint="Name another file.")
    found = verify(path)
    stream = io.StringIO(newline="")
    table = csv.writer(stream)
    columns = ("seq", "time", "kind", "body", "texts", "hash")
    if out.suffix == ".csv":
        table.writerow(columns)
    count = 0
    for record in _chosen(path, kind, "", ""):
        body = {name: value for name, value in record.body.items() if name != "texts"}
        row = dict(
            zip(columns, (record.seq, record.time, record.kind, body, words_of(record), record.hash), strict=True)
        )
        if out.suffix == ".csv":
            table.writerow([json.dumps(cell) if isinstance(cell, dict) else cell for cell in row.values()])
        else:
            stream.write(json.dumps(row) + "\n")
        count += 1
    publish(out, stream.getvalue().encode("utf-8"), "export")
    console = stdout()
    console.print(f"{_counted(count, 'record')} written to", path_text(out))
    _tell(console, path, found)
    if not found.ok:
        raise typer.Exit(FAILED)


@audit_app.command("redact", epilog=REDACT_EXAMPLES)
def redact_log(
    path: Log,
    person: Annotated[str, typer.Option("--as", help="Whose words are erased.")],
    key: Key = None,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do it without asking.")] = False,
) -> None:
    """Erase everything a person said from a log, for good. The log still verifies, and says that texts were erased."""
    from chauffeur.cli.console import columns, plain, stdout
    from chauffeur.concept import PersonId
    from chauffeur.safety.audit import read_key, redact

    whose = person.strip()
    if not yes:
        typer.confirm(f"Erase the words of {whose!r} from {path} for good?", abort=True)
    done = redact(path, PersonId(whose), key=None if key is None else read_key(key))
    console = stdout()
    if not done.records:
        console.print(plain(f"The log holds no words of {whose!r}."))
        return
    what = f"{_counted(done.texts, 'text')} of {_counted(done.records, 'record')}"
    console.print(plain(f"{what} erased. Copies and exports are not reached."))
    console.print(columns([("head", done.head)]))


def auditor_for(path: Path, scenario: Scenario, seed: int) -> DriveRecorder:
    """The auditor of a drive, as the environment wants it.

    Raises:
        DataError: The log cannot be written or continued.
        ConfigError: The key cannot be used, or the environment says something unknown.
    """
    import os

    from chauffeur.concept import ConfigError
    from chauffeur.drive.session_recorder import open_audit

    private = os.environ.get(PRIVATE_VARIABLE, "")
    if private not in ("", "0", "1"):
        raise ConfigError(f"{PRIVATE_VARIABLE} is {private!r}.", hint="Set it to 1, or to 0.")
    key = os.environ.get(KEY_VARIABLE)
    return open_audit(path, scenario, seed, key_file=Path(key) if key else None, private=private == "1")


def tell_closing(console: Console, path: Path, closing: Closing) -> None:
    """Where a drive's audit log is, its head, and whether it is complete."""
    from rich.text import Text

    from chauffeur.cli.console import columns, path_text, plain

    console.print(columns([("audit log", path_text(path)), ("audit head", closing.head)]))
    if not closing.complete:
        missing = f"{_counted(closing.lost, 'record')} missing. {closing.trouble}"
        console.print(Text("The audit log is not complete: ", "bold red"), plain(missing), sep="")


def _chosen(path: Path, kinds: list[str] | None, first: str, last: str) -> Iterator[AuditRecord]:
    from chauffeur.concept import ConfigError
    from chauffeur.safety.audit import KINDS, read_records

    for kind in kinds or ():
        if kind not in KINDS:
            raise ConfigError(f"There is no record kind {kind!r}.", hint=f"Use one of: {', '.join(KINDS)}.")
    low, high = _bound(first), _bound(last)
    for _, record in read_records(path):
        if kinds and record.kind not in kinds:
            continue
        if (low is None or _at(record, low) >= low) and (high is None or _at(record, high) <= high):
            yield record


def _bound(text: str) -> Any:
    """A record number, a time, or None for no bound. Raises ConfigError for anything else."""
    from datetime import UTC, datetime

    from chauffeur.concept import ConfigError

    if not text:
        return None
    if text.isdecimal():
        return int(text)
    try:
        moment = datetime.fromisoformat(text)
    except ValueError as error:
        raise ConfigError(
            f"{text!r} is neither a record number nor a time.", hint="Write it like 120 or 2026-11-21T08:30 (UTC)."
        ) from error
    return moment if moment.tzinfo else moment.replace(tzinfo=UTC)


def _at(record: AuditRecord, bound: Any) -> Any:
    """The record's number or time, whichever the bound is. A time that is none (tampering) counts as the earliest."""
    from datetime import UTC, datetime

    if isinstance(bound, int):
        return record.seq
    try:
        moment = datetime.fromisoformat(record.time)
    except ValueError:
        return datetime.min.replace(tzinfo=UTC)
    return moment if moment.tzinfo else moment.replace(tzinfo=UTC)


def _facts(record: AuditRecord) -> Iterator[str]:
    """The numbers and names of a record, in a line or two."""
    body: dict[str, Any] = {name: value for name, value in record.body.items() if name != "texts"}
    try:
        match record.kind:
            case "actuation":
                yield _actuation(body)
            case "intervention":
                for tick, time_s, reason, before, after in body["interventions"]:
                    change = f"{before[0]:.2f} m/s², {before[1]:.3f} rad -> {after[0]:.2f} m/s², {after[1]:.3f} rad"
                    yield f"{body['rule']}, tick {tick} ({time_s:.1f} s): {change}: {reason}"
            case "verdict":
                where = f", line {body['line']}" if body["line"] else ""
                of = f", wish {body['wish']}" if body.get("wish") else ""
                yield f"{body['check']}{where}{of}: {_judged(body)}"
            case "opened":
                yield _pairs(body) + (" (simulated drive)" if body.get("simulated") else "")
            case _:
                yield _pairs(body)
    except (KeyError, TypeError, ValueError, IndexError):  # another writer, or tampering: what is there is shown
        yield _pairs(body)


def _actuation(body: dict[str, Any]) -> str:
    accelerations = [float(asked[0]) for asked in body["requested"]]
    steering = [float(asked[1]) for asked in body["requested"]]
    (first, last), (begin, end) = body["ticks"], body["time_s"]
    text = (
        f"ticks {first} to {last} ({begin:.1f} to {end:.1f} s): {len(accelerations)} commands, "
        f"{min(accelerations):.2f} to {max(accelerations):.2f} m/s², {min(steering):.3f} to {max(steering):.3f} rad"
    )
    otherwise = len(body["applied_otherwise"])
    return f"{text}; {otherwise} applied otherwise than asked" if otherwise else text


def _pairs(body: dict[str, Any]) -> str:
    import json

    words = (value if isinstance(value, str) else json.dumps(value) for value in body.values())
    return _short(", ".join(f"{name} {word}" for name, word in zip(body, words, strict=True) if word))


def _texts(record: AuditRecord) -> Iterator[str]:
    from chauffeur.safety.audit import words_of

    for name, words in words_of(record).items():
        if words:
            yield f"{name}: {_short(words)}"


def _short(text: str) -> str:
    return text if len(text) <= _MOST_TEXT else f"{text[:_MOST_TEXT]} ... ({len(text)} characters)"


def _tell(console: Console, path: Path, found: AuditVerification) -> None:
    """What verification found, in words."""
    from rich.text import Text

    from chauffeur.cli.console import columns, plain

    if found.ok:
        console.print(
            Text("As it was written", "bold green"), plain(f"{path}: {_counted(found.records, 'record')}"), end=""
        )
        console.print(plain(", not closed." if not found.closed else "."))
    else:
        console.print(Text("Not as it was written", "bold red"), plain(f"{path}: {_counted(found.records, 'record')}."))
        for finding in found.findings:
            console.print(Text("  ✕ ", "bold red"), plain(str(finding)), sep="")
        if found.more_findings:
            console.print(f"  ... and {found.more_findings} more.")
    console.print(columns((name, plain(words)) for name, words in _notes(found)))


def _notes(found: AuditVerification) -> Iterator[tuple[str, str]]:
    yield "head", found.head
    if found.after_head is None:
        yield "anchor", "no head was given: records cut off at the end would not be found"
    else:
        count = found.after_head
        behind = f"{_counted(count, 'record')} written after it" if count else "it is the last record"
        yield "anchor", f"the head is in the log; {behind}"
    words = {
        "none": "the log has none: whoever could write the file could have written it anew",
        "unchecked": "the log has one, and it was not given: a log written anew would not be found",
        "checked": "every record was looked at under the key given",
    }
    yield "key", words[found.key]
    if found.key == "checked":
        ends = {
            "unknown": "the log is of an earlier format, whose key does not vouch for it: keep heads elsewhere",
            "whole": "nothing is missing",
            "open": "what was written after the last opening may be missing",
            "doubtful": "nothing vouches for it",
        }
        yield "end", ends[found.end]
    if found.unclosed:
        yield "unclosed", f"gone on with {_counted(found.unclosed, 'time')} without having been closed before"
    if found.torn_bytes:
        yield "torn end", f"{found.torn_bytes} bytes of a record that was being written (a crash, or a drive going on)"
    if found.redacted:
        yield "redacted", f"{_counted(found.redacted, 'text')} redacted"
    if found.withheld:
        yield "privacy", f"{_counted(found.withheld, 'text')} never written"
    if found.lost:
        yield "lost", f"{_counted(found.lost, 'record')} could not be written in time; the log says where"


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def _judged(body: Mapping[str, Any]) -> str:
    """The judgement of a verdict's record in a word or two."""
    if body["passed"]:
        return "passed"
    return "refused" if body.get("vetoes", True) else "does not fit"
