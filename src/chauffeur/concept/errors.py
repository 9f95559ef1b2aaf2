"""One family of errors: each names the thing, the value and the remedy."""

from __future__ import annotations

from chauffeur.concept.extras import install_command


class ChauffeurError(Exception):
    """Base of every error Chauffeur raises on purpose.

    Attributes:
        hint: What the reader can do now, one sentence; empty when the message says it all.
        retryable: Whether the same call may succeed later without a change.

    >>> try:
    ...     chauffeur.drive("Overtake.", scenario="moon")
    ... except chauffeur.ChauffeurError as error:
    ...     print(error.message)
    Unknown scenario 'moon'.
    """

    def __init__(self, message: str, *, hint: str = "", retryable: bool = False) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        self.retryable = retryable

    def __str__(self) -> str:
        return f"{self.message} {self.hint}".rstrip()


class ConfigError(ChauffeurError):
    """A setting is unknown, missing or out of range."""


class ScenarioError(ChauffeurError):
    """A scenario is unknown, malformed, or cannot be set up as asked."""


class DataError(ChauffeurError):
    """A data file is missing, unreadable or not of the expected form."""


class InstructionError(ChauffeurError):
    """The wish itself cannot be used: empty, or far too long."""


class PlannerError(ChauffeurError):
    """A planner could not produce a plan: endpoint down, bad key, unusable reply."""


class ProgramError(ChauffeurError):
    """A program failed while it ran: it broke a budget, called something wrongly, or raised."""


class SandboxError(ChauffeurError):
    """The sandbox itself is not available or died; not the program's fault."""


class ProfileError(ChauffeurError):
    """A person's profile cannot be opened, read or written."""


class MissingExtraError(ChauffeurError):
    """An optional part is not installed; the hint is the command that installs it."""

    def __init__(self, message: str, *, extra: str = "", hint: str = "") -> None:
        """Args: what cannot be done; the extra of this package that brings it; else what to do."""
        super().__init__(message, hint=f"Run: {install_command(extra)}" if extra else hint)
