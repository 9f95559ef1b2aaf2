"""`chauffeur feedback`: tell the car how a drive was."""

from __future__ import annotations

from typing import Annotated

import typer


def feedback(
    words: Annotated[str, typer.Argument(help="What you have to say of the drive.")],
    person: Annotated[str, typer.Option("--as", help="Whose profile it goes to.")],
    trip: Annotated[str | None, typer.Option(help="Which trip; default the last one.")] = None,
) -> None:
    """Say how a drive was; the next drive of the same person takes it into account."""
    from rich.text import Text

    from chauffeur.cli.console import plain, stdout
    from chauffeur.concept import InstructionError, PersonId, ProfileError
    from chauffeur.hmi.words import feedback_words
    from chauffeur.memory.choice import open_memory
    from chauffeur.memory.feedback import interpret_feedback

    said = " ".join(words.split())
    if not said:
        raise InstructionError("The feedback is empty.", hint='Say it in words, e.g. "a bit too fast".')
    meant = interpret_feedback(said)
    if not open_memory().attach_feedback(PersonId(person), meant, trip):
        which = f"trip {trip}" if trip else "a trip"
        raise ProfileError(
            f"The profile of {person!r} holds no {which.removeprefix('a ')}.",
            hint=f'Drive first: chauffeur drive "..." --as {person}',
        )
    console = stdout()
    console.print(Text.assemble("Understood: ", (feedback_words(meant), "bold"), f" (strength {meant.strength:.2f})"))
    console.print(Text.assemble("Kept in the profile of ", plain(person), "."))
