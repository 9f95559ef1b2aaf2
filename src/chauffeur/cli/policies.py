"""`chauffeur show policies` and `chauffeur model policies`: look into a policy repository, put it right, share it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

    from chauffeur.memory.policies import Merged, PolicyEntry, PolicyRepository, Rejected

policies_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="Policy repositories (programs that did well, learned from feedback): describe, prune, share.",
)

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="The repository.")]
Name = Annotated[str, typer.Argument(metavar="NAME", help="A program's name as it is called, or its id.")]


@policies_app.callback()
def policies() -> None:
    """Policy repositories."""


def show_policies(
    folder: Folder,
    name: Annotated[str, typer.Argument(metavar="NAME", help="One program, in full; all in short without it.")] = "",
    query: Annotated[str, typer.Option("--for", help="Order them by how near they are to this wish.")] = "",
) -> None:
    """List learned programs: what each does, what it was learned for, who judged it; or show one of them."""
    if name:
        _show_one(folder, name)
    else:
        _list(folder, query)


def _list(folder: Path, query: str) -> None:
    from rich.text import Text

    from chauffeur.cli.console import path_text, plain, stdout, table
    from chauffeur.memory.policies import CRITIC_LABELS

    console = stdout()
    repository = _open(folder)
    entries = repository.entries
    likeness: dict[str, float] = {}
    if query:
        recalled = sorted(
            (one for world in _worlds(repository) for one in repository.recall(query, world, len(entries))),
            key=lambda one: one.similarity,
        )
        likeness = {one.entry.id: one.similarity for one in recalled}
        entries = tuple(sorted(entries, key=lambda entry: -likeness.get(entry.id, 0.0)))
    lines = [
        (
            Text(f"{entry.callable_name}()", "bold"),
            plain(entry.command),
            plain(entry.world),
            "person" if entry.judged_by == "person" else "evaluator (not a person)",
            _score(entry),
            *((f"{likeness.get(entry.id, 0.0):.2f}",) if query else ()),
        )
        for entry in entries
    ]
    heads = ("program", "learned for", "road", "judged by", "score", *(("near",) if query else ()))
    console.print(table(heads, lines, right=("score", "near")))
    console.print(path_text(folder), plain(f"{len(entries)} programs, sha256 {repository.digest[:12]}"))
    for label in repository.labels or (CRITIC_LABELS["person"],) * bool(entries):
        console.print(plain(label), style="bold")
    _not_believed(console, repository)


def _show_one(folder: Path, name: str) -> None:
    from rich.syntax import Syntax

    from chauffeur.cli.console import columns, plain, stdout
    from chauffeur.memory.policies import CRITIC_LABELS

    entry = _open(folder).find(name)
    words = {"model": "by the model", "person": "by a person", "fallback": "fallback wording, not the model's"}
    metrics = ", ".join(f"{metric} {value:.4g}" for metric, value in entry.metrics)
    rows = [
        ("program", f"{entry.callable_name}() (version {entry.version}, id {entry.id})"),
        ("description", f"{entry.description} ({words[entry.described_by]})"),
        ("learned for", f"“{entry.command}”"),
        ("situation", entry.context),
        ("where", f"{entry.item} ({entry.world})"),
        ("drive", ", ".join(part for part in (entry.outcome, metrics, "simulated") if part)),
        ("judged", CRITIC_LABELS[entry.judged_by]),
        *((f"critique {number}", text) for number, text in enumerate(entry.critiques, start=1)),
        ("model", f"{entry.planner}, {entry.model}"),
        ("learned", f"{entry.learned}, chauffeur {entry.chauffeur}"),
        *([("received", entry.received)] if entry.received else []),
    ]
    console = stdout()
    console.print(columns(((label, plain(text)) for label, text in rows), indent=0))
    source = plain(entry.callable_source.rstrip("\n")).plain
    console.print(Syntax(source, "python", theme="ansi_dark", background_color="default", word_wrap=True))


@policies_app.command()
def describe(
    folder: Folder,
    name: Name,
    words: Annotated[str, typer.Argument(metavar="TEXT", help="What the program does.")],
) -> None:
    """Give a program a description of your own; it is found by it."""
    from chauffeur.cli.console import plain, stdout

    repository = _open(folder)
    entry = repository.describe(repository.find(name), words)
    stdout().print(plain(f"{entry.callable_name}(): {entry.description}"))


@policies_app.command()
def prune(
    folder: Folder,
    names: Annotated[list[str] | None, typer.Argument(metavar="NAME", help="Programs to take out.")] = None,
    superseded: Annotated[
        bool, typer.Option("--superseded", help="Those learned again later for the same wish.")
    ] = False,
    judged_by: Annotated[str, typer.Option(help="Those judged by `evaluator`, or by `person`.")] = "",
    below: Annotated[float | None, typer.Option(help="Those whose drive scored fewer points than this.")] = None,
    rejected: Annotated[bool, typer.Option("--rejected", help="Lines of the file that are not believed.")] = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do it without asking.")] = False,
) -> None:
    """Take programs out of a repository. They are listed first."""
    from chauffeur.cli.console import plain, stdout
    from chauffeur.concept import ConfigError
    from chauffeur.memory.policies import superseded as older

    if judged_by not in ("", "person", "evaluator"):
        raise ConfigError(f"Unknown judge {judged_by!r}.", hint="Use person or evaluator.")
    repository = _open(folder)
    chosen = {entry.id: entry for entry in (repository.find(name) for name in names or ())}
    if superseded:
        chosen |= {entry.id: entry for entry in older(repository.entries)}
    if judged_by:
        chosen |= {entry.id: entry for entry in repository.entries if entry.judged_by == judged_by}
    if below is not None:
        chosen |= {e.id: e for e in repository.entries if (score := e.score) is not None and score < below}
    console = stdout()
    lines = len(repository.rejected) if rejected else 0
    if not chosen and not lines:
        console.print("Nothing to take out.")
        return
    for entry in chosen.values():
        console.print(plain(f"{entry.callable_name}()  “{entry.command}”  {_score(entry)}"))
    if lines:
        console.print(f"{lines} lines that are not believed")
    if not yes:
        typer.confirm("Take these out for good?", abort=True)
    gone = repository.prune(chosen.keys(), drop_rejected=rejected)
    console.print(plain(f"{gone} programs taken out; {len(repository.entries)} are left."))


@policies_app.command("export")
def export_policies(
    folder: Folder,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The file to write, JSON lines.")],
    names: Annotated[list[str] | None, typer.Argument(metavar="NAME", help="Programs to write; default all.")] = None,
) -> None:
    """Write programs to one file for somebody else. It holds wishes and critiques in their own words."""
    from chauffeur.cli.console import path_text, plain, stdout

    repository = _open(folder)
    entries = [repository.find(name) for name in names] if names else list(repository.entries)
    repository.export(file, entries)
    stdout().print(plain(f"{len(entries)} programs written to"), path_text(file))


@policies_app.command()
def add(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="The repository to add to; made if there is none.")],
    others: Annotated[
        list[Path], typer.Argument(metavar="OTHER...", help="Repositories, or files that `export` wrote.")
    ],
) -> None:
    """Add the programs of others. Each is checked before it is believed; names that collide get a version."""
    from chauffeur.memory.policies import PolicyRepository, read_policies

    sources: list[tuple[Path, Sequence[PolicyEntry], Sequence[Rejected]]] = []
    for other in others:
        if other.is_dir():
            source = _open(other)
            sources.append((other, source.entries, source.rejected))
        else:
            sources.append((other, *read_policies(other)))
    repository = PolicyRepository(folder, create=True)
    for other, entries, rejected in sources:
        merged = repository.merge(entries, received=f"from {other.name}")
        _say_merged(str(other), merged, [one.reason for one in rejected])


def _open(folder: Path) -> PolicyRepository:
    from chauffeur.memory.policies import PolicyRepository

    return PolicyRepository(folder)


def _worlds(repository: PolicyRepository) -> list[str]:
    return sorted({entry.world for entry in repository.entries})


def _score(entry: PolicyEntry) -> str:
    return "" if entry.score is None else f"{entry.score:.1f}"


def _say_merged(source: str, merged: Merged, rejected: Sequence[str]) -> None:
    from chauffeur.cli.console import plain, stdout

    console = stdout()
    console.print(plain(f"{source}: {len(merged.added)} programs added, {merged.known} known already."))
    for entry in merged.added:
        if entry.version > 1:
            console.print(plain(f"  {entry.name} is {entry.callable_name} here"))
    for reason in (*rejected, *(one.reason for one in merged.rejected)):
        console.print(plain(f"  not believed: {reason}"), style="yellow")


def _not_believed(console: Console, repository: PolicyRepository) -> None:
    from chauffeur.cli.console import plain

    for one in repository.rejected:
        console.print(plain(f"line {one.line} is not believed: {one.reason}"), style="yellow")
