"""What can go wrong with hearing, beside bad files (`DataError`) and missing libraries (`MissingExtraError`)."""

from __future__ import annotations

from chauffeur.concept import ChauffeurError


class MicrophoneError(ChauffeurError):
    """There is no microphone, it cannot be opened, or it stopped giving sound."""


class RecogniserError(ChauffeurError):
    """A recogniser gave no transcript: its endpoint is down, refused, too slow, or answered with nonsense."""
