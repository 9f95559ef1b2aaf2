"""Speech to words: sound, voice activity, hotwords, engines; and words to speech. The sound itself is never kept."""

from chauffeur.speech.audio import Recording, read_recording
from chauffeur.speech.base import HOTWORDS, Heard, Recogniser
from chauffeur.speech.engines import open_recogniser
from chauffeur.speech.errors import MicrophoneError
from chauffeur.speech.listener import Listener, hear_recording
from chauffeur.speech.microphone import Microphone

__all__ = [
    "HOTWORDS",
    "Heard",
    "Listener",
    "Microphone",
    "MicrophoneError",
    "Recogniser",
    "Recording",
    "hear_recording",
    "open_recogniser",
    "read_recording",
]
