"""Speech to words: sound, voice activity, hotwords, engines; and words to speech. The sound itself is never kept."""

from chauffeur.speech.audio import SAMPLE_RATE_HZ, Recording, Samples, decode, read_recording
from chauffeur.speech.base import HOTWORDS, Expect, Heard, Hotword, Recogniser, Timing, Transcript
from chauffeur.speech.engines import ENGINES, open_recogniser
from chauffeur.speech.errors import MicrophoneError, RecogniserError
from chauffeur.speech.listener import Listener, hear_recording
from chauffeur.speech.microphone import Microphone

__all__ = [
    "ENGINES",
    "HOTWORDS",
    "SAMPLE_RATE_HZ",
    "Expect",
    "Heard",
    "Hotword",
    "Listener",
    "Microphone",
    "MicrophoneError",
    "Recogniser",
    "RecogniserError",
    "Recording",
    "Samples",
    "Timing",
    "Transcript",
    "decode",
    "hear_recording",
    "open_recogniser",
    "read_recording",
]
