"""Bodies of HTTP answers from outside, bounded before they are unpacked."""

from __future__ import annotations

import zlib
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Final, cast

import httpx

from chauffeur.foreign.complaints import ForeignBodyError

UNPACKED: Final = {"Accept-Encoding": "identity"}
"""Header that asks for bodies as they are."""
_REFUSAL_BYTES: Final = 64_000
"""Most that is read of an answer that is no success."""
_STEP_BYTES: Final = 65_536
_GZIP_OR_ZLIB: Final = zlib.MAX_WBITS + 32


class _BoundedBody(httpx.AsyncByteStream):
    """A body that is unpacked piece by piece, never beyond a bound."""

    def __init__(self, raw: httpx.AsyncByteStream, packing: str, most_bytes: int, *, cut: bool) -> None:
        """Args: the body as it comes; its content encoding; most bytes unpacked; end there instead of failing."""
        self._raw, self._packing, self._most, self._cut = raw, packing, most_bytes, cut

    async def aclose(self) -> None:
        await self._raw.aclose()

    async def __aiter__(self) -> AsyncIterator[bytes]:
        room = self._most
        async for piece in self._steps():
            if len(piece) > room and not self._cut:
                raise ForeignBodyError(f"The answer has more than {self._most:,} bytes.")
            yield piece[:room]
            room -= len(piece)
            if room <= 0 and self._cut:
                return

    async def _steps(self) -> AsyncIterator[bytes]:
        unpack = zlib.decompressobj(_GZIP_OR_ZLIB) if self._packing else None
        async for piece in self._raw:
            if unpack is None:
                yield piece
                continue
            rest = piece
            while rest:
                try:
                    yield unpack.decompress(rest, _STEP_BYTES)
                except zlib.error as error:
                    raise ForeignBodyError(f"The answer cannot be unpacked: {error}.") from error
                rest = unpack.unconsumed_tail
        if unpack is not None and not unpack.eof:
            raise ForeignBodyError("The packed answer breaks off.")


def bounding(most_bytes: int) -> Callable[[httpx.Response], Awaitable[None]]:
    """A hook for the responses of an `httpx.AsyncClient`, so that no body grows beyond a bound, packed or not.

    Args:
        most_bytes: Longest body of a success; of another answer the beginning is read.
    """

    async def bound(response: httpx.Response) -> None:
        packing = response.headers.pop("content-encoding", "").strip().lower().replace("identity", "")
        if packing not in ("", "gzip", "x-gzip", "deflate"):
            # Not asked for; a few bytes of zstd or brotli may unpack to gigabytes in one go.
            raise ForeignBodyError(f"The answer is packed ({packing[:20]}), which was not asked for.")
        raw = cast("httpx.AsyncByteStream", response.stream)
        most = most_bytes if response.is_success else min(most_bytes, _REFUSAL_BYTES)
        response.stream = _BoundedBody(raw, packing, most, cut=not response.is_success)

    return bound
