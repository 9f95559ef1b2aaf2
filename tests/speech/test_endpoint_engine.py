"""The transcription client against a real server, in all the moods servers have."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator

import numpy as np
import pytest
from speech_server import TranscriptionServer

from chauffeur.concept import ConfigError
from chauffeur.speech.audio import decode
from chauffeur.speech.base import Transcript
from chauffeur.speech.endpoint import EndpointRecogniser
from chauffeur.speech.errors import RecogniserError

pytestmark = pytest.mark.server

KEY = "sk-loopback-0123456789"
SOUND = (np.arange(4000) % 977 - 488).astype(np.int16)


@pytest.fixture
def server() -> Iterator[TranscriptionServer]:
    server = TranscriptionServer()
    yield server
    server.close()


def engine(server: TranscriptionServer, timeout_s: float = 10.0, **environ: str) -> EndpointRecogniser:
    return EndpointRecogniser(server.url, "whisper-1", timeout_s=timeout_s, environ=environ)


def verbose(text: str, *segments: tuple[str, float, float]) -> dict[str, object]:
    """An answer in the form `verbose_json` has."""
    parts = [
        {"id": k, "start": 0.0, "end": 1.0, "text": said, "avg_logprob": logprob, "no_speech_prob": silent}
        for k, (said, logprob, silent) in enumerate(segments)
    ]
    return {"task": "transcribe", "language": "english", "duration": 1.0, "text": text, "segments": parts}


def test_the_form_holds_the_sound_the_model_and_the_key(server: TranscriptionServer) -> None:
    found = engine(server, CHAUFFEUR_SPEECH_KEY=KEY).recognise(SOUND)
    assert found == Transcript("Command: slow down.")
    (asked,) = server.requests
    assert asked.path == "/v1/audio/transcriptions"
    assert asked.headers["authorization"] == f"Bearer {KEY}"
    assert asked.fields["model"] == "whisper-1" and asked.fields["language"] == "en"
    assert asked.fields["response_format"] == "verbose_json" and "Command" in asked.fields["prompt"]
    assert (asked.file_name, asked.file_type) == ("utterance.wav", "audio/wav")
    assert np.array_equal(decode(asked.file).samples, SOUND)


def test_a_server_of_ones_own_needs_no_key(server: TranscriptionServer) -> None:
    engine(server).recognise(SOUND)
    assert "authorization" not in server.requests[0].headers


def test_segments_say_how_sure_it_is(server: TranscriptionServer) -> None:
    server.say(fields=verbose(" Command, stop. Now!", (" Command, stop.", -0.1, 0.01), (" Now!", -0.9, 0.02)))
    found = engine(server).recognise(SOUND)
    assert found.text == "Command, stop. Now!"
    assert found.confidence == pytest.approx(np.exp(-0.9)) and found.to_confirm
    server.say(fields=verbose("Command, stop.", ("Command, stop.", -0.1, 0.01)))
    assert not engine(server).recognise(SOUND).to_confirm


def test_what_whisper_hears_in_silence_is_not_a_wish(server: TranscriptionServer) -> None:
    server.say(fields=verbose("Thank you.", ("Thank you.", -1.2, 0.93)))
    assert engine(server).recognise(SOUND).text == ""
    server.say("   ")
    assert engine(server).recognise(SOUND) == Transcript("", reason="There are no words in it.")


@pytest.mark.parametrize(
    "segments",
    [None, 3, "x", [3], [{}], [{"text": "a"}], [{"text": "a", "avg_logprob": "x"}], [{"text": "a", "avg_logprob": 3}]],
)
def test_segments_of_another_form_are_left_alone(server: TranscriptionServer, segments: object) -> None:
    server.say(fields={"text": "Command stop", "segments": segments})
    assert engine(server).recognise(SOUND) == Transcript("Command stop")


def test_hidden_and_endless_text_is_not_passed_on(server: TranscriptionServer) -> None:
    server.say("command\u200b stop\x07\n now\u202e")
    assert engine(server).recognise(SOUND).text == "command stop now"
    server.say("command " * 300)
    found = engine(server).recognise(SOUND)
    assert found.text == "" and "characters" in found.reason


@pytest.mark.parametrize(
    ("status", "headers", "words", "retryable"),
    [
        (401, {}, r"refused the key \(401\): who are you", False),
        (403, {}, r"failed \(403\): who are you", False),
        (404, {}, r"no model 'whisper-1' \(404\)", False),
        (413, {}, r"failed \(413\)", False),
        (429, {"Retry-After": "7"}, r"limits requests \(429\).*Wait 7 s", True),
        (500, {}, r"failed \(500\).*Say it again", True),
        (503, {}, r"failed \(503\)", True),
        (302, {"Location": "http://127.0.0.1:9/elsewhere"}, r"redirects elsewhere \(302\)", False),
    ],
)
def test_refusals_say_what_to_do(
    server: TranscriptionServer, status: int, headers: dict[str, str], words: str, retryable: bool
) -> None:
    server.say(status=status, fields={"error": {"message": f"who are you, {KEY}?"}}, headers=headers)
    with pytest.raises(RecogniserError, match=words) as caught:
        engine(server, OPENAI_API_KEY=KEY).recognise(SOUND)
    assert caught.value.retryable == retryable
    assert KEY not in str(caught.value)
    assert len(server.requests) == 1


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (b"<html>sign in</html>", "not JSON"),
        (b'{"text": "half', "not JSON"),
        (b"", "not JSON"),
        (b"[" * 60_000, "not JSON"),
        (b"[]", "without a text"),
        (b'{"text": 3}', "without a text"),
        (b'{"text": "' + b"a" * 70_000 + b'"}', "more than 65,536 bytes"),
    ],
)
def test_nonsense_is_said_to_be_nonsense(server: TranscriptionServer, body: bytes, words: str) -> None:
    server.say(body=body)
    with pytest.raises(RecogniserError, match=words):
        engine(server).recognise(SOUND)


@pytest.mark.parametrize("how", [{"wait_s": 30.0}, {"drip_s": 0.05}])
def test_the_deadline_holds_for_the_whole_answer(server: TranscriptionServer, how: dict[str, float]) -> None:
    server.say("a" * 1000, **how)
    started = time.monotonic()
    with pytest.raises(RecogniserError, match=r"no transcript within 0\.4 s") as caught:
        engine(server, timeout_s=0.4).recognise(SOUND)
    assert caught.value.retryable
    assert time.monotonic() - started < 5.0


def test_who_hangs_up_and_who_is_not_there(server: TranscriptionServer) -> None:
    server.say("", hang_up=True)
    with pytest.raises(RecogniserError, match="cannot be reached"):
        engine(server).recognise(SOUND)
    server.close()
    with pytest.raises(RecogniserError, match="cannot be reached") as caught:
        engine(server).recognise(SOUND)
    assert caught.value.retryable


def test_it_may_be_called_where_a_loop_runs(server: TranscriptionServer) -> None:
    async def call() -> Transcript:
        return engine(server).recognise(SOUND)

    assert asyncio.run(call()).text == "Command: slow down."


@pytest.mark.parametrize(
    ("url", "environ", "words"),
    [
        ("ftp://host/v1", {}, "not an HTTP address"),
        ("http://[::1", {}, "not an HTTP address"),
        ("http://me:pw@host/v1", {}, "more than host and path"),
        ("http://host/v1?key=3", {}, "more than host and path"),
        ("http://speech.example.com/v1", {"OPENAI_API_KEY": KEY}, "unencrypted"),
        ("https://speech.example.com/v1", {"OPENAI_API_KEY": "a b"}, "characters no key has"),
    ],
)
def test_addresses_and_keys_are_checked_before_anything_is_sent(url: str, environ: dict[str, str], words: str) -> None:
    with pytest.raises(ConfigError, match=words) as caught:
        EndpointRecogniser(url, environ=environ)
    assert KEY not in str(caught.value) and "pw" not in str(caught.value)


def test_the_environment_names_the_endpoint(server: TranscriptionServer) -> None:
    environ = {"CHAUFFEUR_SPEECH_URL": server.url, "OPENAI_BASE_URL": "http://127.0.0.1:9/v1"}
    assert EndpointRecogniser(environ=environ).recognise(SOUND).text == "Command: slow down."
    for bad in (0.0, float("nan"), float("inf")):
        with pytest.raises(ConfigError, match="timeout"):
            EndpointRecogniser(server.url, timeout_s=bad, environ={})
