"""`chauffeur audit`: check an audit log, and erase a person's words from it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console

    from chauffeur.concept import Scenario
    from chauffeur.driving.recorder import DriveRecorder
    from chauffeur.safety.audit import AuditVerification, Closing

KEY_VARIABLE: Final = "CHAUFFEUR_AUDIT_KEY"
"""Environment variable that names the key file."""

PRIVATE_VARIABLE: Final = "CHAUFFEUR_AUDIT_PRIVATE"
"""Environment variable that keeps a person's words out of audit logs when it is set to 1."""

audit_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Audit logs of drives: verify, redact.",
)

Log = Annotated[Path, typer.Argument(metavar="PATH", help="The audit log.")]
Key = Annotated[
    Path | None,
    typer.Option("--key", metavar="FILE", envvar=KEY_VARIABLE, help="Key that the log was written with."),
]


@audit_app.callback()
def audit() -> None:
    """Audit logs of drives."""


@audit_app.command("verify")
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


@audit_app.command("redact")
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


def audit_options() -> tuple[Path | None, bool]:
    """What the environment says of audit logs: the key file, and whether a person's words are kept out.

    Raises:
        ConfigError: The environment says something unknown.
    """
    import os

    from chauffeur.concept import ConfigError

    private = os.environ.get(PRIVATE_VARIABLE, "")
    if private not in ("", "0", "1"):
        raise ConfigError(f"{PRIVATE_VARIABLE} is {private!r}.", hint="Set it to 1, or to 0.")
    key = os.environ.get(KEY_VARIABLE)
    return Path(key) if key else None, private == "1"


def auditor_for(path: Path, scenario: Scenario, seed: int) -> DriveRecorder:
    """The auditor of a drive, as the environment wants it.

    Raises:
        DataError: The log cannot be written or continued.
        ConfigError: The key cannot be used, or the environment says something unknown.
    """
    from chauffeur.driving.recorder import open_audit

    key_file, private = audit_options()
    return open_audit(path, scenario, seed, key_file=key_file, private=private)


def tell_closing(console: Console, path: Path, closing: Closing) -> None:
    """Where a drive's audit log is, its head, and whether it is complete."""
    from rich.text import Text

    from chauffeur.cli.console import columns, path_text, plain

    console.print(columns([("audit log", path_text(path)), ("audit head", closing.head)]))
    if not closing.complete:
        missing = f"{_counted(closing.lost, 'record')} missing. {closing.trouble}"
        console.print(Text("The audit log is not complete: ", "bold red"), plain(missing), sep="")


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
