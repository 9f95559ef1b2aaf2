"""Any OpenAI-compatible transcription endpoint: a cloud service, or a server of one's own."""

from __future__ import annotations

import asyncio
import json
import math
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final, cast

import httpx

from chauffeur.concept import ConfigError
from chauffeur.concept.addresses import http_address, read_key
from chauffeur.foreign.bodies import UNPACKED, bounding
from chauffeur.foreign.complaints import ForeignBodyError, server_words
from chauffeur.language.letters import clean
from chauffeur.speech.audio import Samples, wave_bytes
from chauffeur.speech.base import Expect, Transcript
from chauffeur.speech.errors import RecogniserError
from chauffeur.speech.whisper import PROMPT, transcript

URL_VARIABLES: Final = ("CHAUFFEUR_SPEECH_URL", "OPENAI_BASE_URL")
"""Environment variables that name the endpoint, the first that is set counts."""

KEY_VARIABLES: Final = ("CHAUFFEUR_SPEECH_KEY", "OPENAI_API_KEY")
"""Environment variables that hold its key, the first that is set counts."""

DEFAULT_URL: Final = "https://api.openai.com/v1"
DEFAULT_MODEL: Final = "whisper-1"
TIMEOUT_S: Final = 10.0
"""For the whole exchange: an answer to a wish that is older is of no use to a moving car."""

_CONNECT_S: Final = 3.0
_MOST_BYTES: Final = 64 * 1024
_MOST_CHARS: Final = 1000
_SAID_CHARS: Final = 200


class EndpointRecogniser:
    """Hears free speech somewhere else. The sound leaves this machine; only what was said with a button held should."""

    def __init__(
        self,
        base_url: str | None = None,
        model: str = DEFAULT_MODEL,
        *,
        timeout_s: float = TIMEOUT_S,
        environ: Mapping[str, str] = os.environ,
    ) -> None:
        """Check the address and read the key; nothing is sent yet.

        Args:
            base_url: Usually ends in /v1; from the environment, else OpenAI's, if left out.
            model: Name that the endpoint knows its model by.
            timeout_s: For the whole exchange.
            environ: Environment.

        Raises:
            ConfigError: Not an HTTP address, or a key would cross a public network unencrypted.
        """
        given = base_url or next((environ[name] for name in URL_VARIABLES if environ.get(name)), DEFAULT_URL)
        what, example = "The address of the speech endpoint", "http://host:8000/v1"
        address = http_address(given, what, example=example, key_place=KEY_VARIABLES[0])
        self._url = address.url
        self._key, self._key_variable = read_key(address, KEY_VARIABLES, environ) or ("", "")
        if not (math.isfinite(timeout_s) and timeout_s > 0.0):
            raise ConfigError(f"A timeout of {timeout_s:g} s is none.", hint="Give seconds, e.g. 10.")
        self._model = model
        self._timeout_s = timeout_s

    @property
    def name(self) -> str:
        """`endpoint/` and the model's name."""
        return f"endpoint/{self._model}"

    @property
    def remote(self) -> bool:
        """The sound leaves this machine."""
        return True

    def recognise(self, samples: Samples, expect: Expect = "open") -> Transcript:
        """Words of one utterance. One try: when it fails, the person says it again, or types it.

        Args:
            samples: Mono at 16 kHz.
            expect: Not needed: the vocabulary is free.

        Raises:
            RecogniserError: No usable answer in time; `retryable` where saying it again may help.
        """
        del expect
        # A loop of its own makes the deadline hold for every part of the exchange, and Ctrl-C end it at once.
        try:
            asyncio.get_running_loop()
        except RuntimeError:
            return asyncio.run(self._ask(samples))
        with ThreadPoolExecutor(1) as pool:  # two loops do not run in one thread
            return pool.submit(asyncio.run, self._ask(samples)).result()

    async def _ask(self, samples: Samples) -> Transcript:
        try:
            async with asyncio.timeout(self._timeout_s):
                status, body, retry_after = await self._send(samples)
        except (TimeoutError, httpx.TimeoutException) as error:
            raise RecogniserError(
                f"{self._url} gave no transcript within {self._timeout_s:g} s.", hint="Say it again.", retryable=True
            ) from error
        except ForeignBodyError as error:
            raise RecogniserError(f"{self._url} gave no transcript: {error}") from error
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise RecogniserError(
                f"{self._url} cannot be reached: {self._scrub(str(error)) or type(error).__name__}.",
                hint="Start the server, or check the address and the network connection.",
                retryable=True,
            ) from error
        if status != 200:
            raise self._refused(status, body, retry_after)
        return _read(self._url, body)

    async def _send(self, samples: Samples) -> tuple[int, bytes, str]:
        """(status, body as far as it is read, Retry-After)."""
        headers = {"Authorization": f"Bearer {self._key}"} if self._key else {}
        form = {"model": self._model, "language": "en", "prompt": PROMPT, "temperature": "0"}
        form["response_format"] = "verbose_json"
        files = {"file": ("utterance.wav", wave_bytes(samples), "audio/wav")}
        timeout = httpx.Timeout(self._timeout_s, connect=min(_CONNECT_S, self._timeout_s))
        # No redirects: a key does not follow them to another host.
        async with (
            httpx.AsyncClient(
                timeout=timeout,
                follow_redirects=False,
                headers=UNPACKED,
                event_hooks={"response": [bounding(_MOST_BYTES)]},
            ) as client,
            client.stream(
                "POST", f"{self._url}/audio/transcriptions", data=form, files=files, headers=headers
            ) as reply,
        ):
            return reply.status_code, await reply.aread(), reply.headers.get("retry-after", "")

    def _refused(self, status: int, body: bytes, retry_after: str) -> RecogniserError:
        said = self._scrub(_message(body))
        said = f": {said}" if said else ""
        if status == 401:
            hint = f"Check the key in {self._key_variable}." if self._key else f"Set {KEY_VARIABLES[0]}."
            return RecogniserError(f"{self._url} refused the key (401){said}.", hint=hint)
        if status == 404:
            return RecogniserError(
                f"{self._url} has no transcription, or no model {self._model!r} (404){said}.",
                hint="Check the address; it usually ends in /v1.",
            )
        if status == 429:
            wait = f"Wait {retry_after} s." if retry_after.isdecimal() else "Try later."
            return RecogniserError(f"{self._url} limits requests (429){said}.", hint=wait, retryable=True)
        if 300 <= status < 400:
            return RecogniserError(f"{self._url} redirects elsewhere ({status}).", hint="Give the address it is at.")
        retryable = status in (408, 409, 425) or status >= 500
        hint = "Say it again." if retryable else ""
        return RecogniserError(f"{self._url} failed ({status}){said}.", hint=hint, retryable=retryable)

    def _scrub(self, text: str) -> str:
        """Text of a stranger: one line, short, and without our key."""
        text = text.replace(self._key, "***") if self._key else text
        return " ".join(clean(text).split())[:_SAID_CHARS].rstrip(".")


def _read(url: str, body: bytes) -> Transcript:
    """What a 200 says: `{"text": ...}`, with segments where the server knows `verbose_json`."""
    try:
        answer: Any = json.loads(body)
    except (ValueError, RecursionError) as error:
        raise RecogniserError(
            f"{url} answered with something that is not JSON.", hint="Check the address; it usually ends in /v1."
        ) from error
    text: Any = cast("dict[str, Any]", answer).get("text") if isinstance(answer, dict) else None
    if not isinstance(text, str):
        raise RecogniserError(f"{url} answered without a text.", hint="Check the address; it usually ends in /v1.")
    text = " ".join(clean(text).split())
    if len(text) > _MOST_CHARS:
        return Transcript("", reason=f"The transcript has {len(text)} characters; no wish has.")
    segments = _segments(cast("dict[str, Any]", answer).get("segments"))
    if segments:
        judged = transcript(segments)
        # The whole text counts, the segments only say how sure it is.
        return Transcript(text, judged.confidence, to_confirm=judged.to_confirm) if judged.text and text else judged
    return Transcript(text) if text else Transcript("", reason="There are no words in it.")


def _segments(found: Any) -> list[tuple[str, float, float]]:
    """Segments that carry a text and probabilities; none where one does not."""
    out: list[tuple[str, float, float]] = []
    for one in cast("list[Any]", found) if isinstance(found, list) else []:
        segment = cast("dict[str, Any]", one) if isinstance(one, dict) else {}
        text, logprob, silent = (segment.get(name) for name in ("text", "avg_logprob", "no_speech_prob"))
        if not (isinstance(text, str) and isinstance(logprob, int | float)):
            return []
        silent = float(silent) if isinstance(silent, int | float) else 0.0
        if not (math.isfinite(logprob) and logprob <= 0.0 and math.isfinite(silent)):
            return []
        out.append((text, float(logprob), silent))
    return out


def _message(body: bytes) -> str:
    """The server's own words about an error."""
    try:
        return server_words(json.loads(body))
    except (ValueError, RecursionError):
        return ""
