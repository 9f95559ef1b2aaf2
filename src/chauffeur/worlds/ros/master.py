"""Calls to a ROS 1 master, or to another node, that end in time and fail in words."""

from __future__ import annotations

import http.client
import time
import xmlrpc.client
from typing import Any, Final
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError

from chauffeur.worlds.ros.base import VehicleError

TIMEOUT_S: Final = 2.0
"""How long one call may take in all; a master on the vehicle answers in milliseconds."""

LARGEST_REPLY: Final = 8 * 1024 * 1024
"""Bytes of a reply; the whole state of a large graph takes some 100 kB."""


_NONSENSE: Final = (
    xmlrpc.client.Error,
    ExpatError,
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    ArithmeticError,
)
"""What reading an answer raises that is none of XML-RPC's."""


class MasterError(VehicleError):
    """The master did not answer, or not with what was asked."""


class MasterRefusedError(MasterError):
    """The master answered, with no: what was asked for is not there."""


class _Transport(xmlrpc.client.Transport):
    """HTTP with an end: a time for the whole call, and a most of bytes."""

    accept_gzip_encoding = False  # a few bytes of reply could otherwise grow without end

    def __init__(self, timeout_s: float) -> None:
        super().__init__()
        self._timeout_s = timeout_s
        self._end_s = time.monotonic() + timeout_s

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        return http.client.HTTPConnection(str(host), timeout=self._timeout_s)

    def parse_response(self, response: http.client.HTTPResponse) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        parser, unmarshaller = self.getparser()
        taken = 0
        while data := response.read1(65536):
            taken += len(data)
            if taken > LARGEST_REPLY or time.monotonic() > self._end_s:
                raise TimeoutError("the reply does not end")
            parser.feed(data)
        parser.close()
        return unmarshaller.close()


def call(uri: str, who: str, method: str, *arguments: Any, timeout_s: float = TIMEOUT_S) -> Any:
    """Call a method of the ROS master or slave API and return its value.

    Args:
        uri: Where.
        who: Whom to name when it fails, e.g. `ROS master`.
        method: Name of the method.
        arguments: Its arguments.
        timeout_s: Seconds the call may take.

    Raises:
        RefusedError: The answer is a refusal.
        MasterError: Nobody answers, not in time, or not this protocol.
    """
    place = f"{who} at {uri}"
    try:
        proxy = xmlrpc.client.ServerProxy(uri, transport=_Transport(timeout_s))
        reply: Any = getattr(proxy, method)(*arguments)
    except ConnectionRefusedError as error:
        raise MasterError(f"No {place}: the connection is refused.", retryable=True) from error
    except TimeoutError as error:
        raise MasterError(f"The {place} does not answer within {timeout_s:g} s.", retryable=True) from error
    except xmlrpc.client.Fault as error:
        raise MasterError(f"The {place} failed in {method}: {error.faultString[:200]}", retryable=True) from error
    except (OSError, http.client.HTTPException) as error:
        raise MasterError(f"The {place} cannot be reached: {error!r}.", retryable=True) from error
    except _NONSENSE as error:
        raise MasterError(f"What answers as {place} is none: {error!r}.", retryable=True) from error
    if not (isinstance(reply, list | tuple) and len(reply) == 3):
        raise MasterError(f"The {place} answered {method} with {str(reply)[:80]!r}.", retryable=True)
    code, words, value = reply
    if code != 1:
        raise MasterRefusedError(f"The {place} refused {method}: {str(words)[:200]}", retryable=True)
    return value


def check_uri(uri: str) -> str:
    """The URI, if it is one of a master.

    Raises:
        VehicleError: It is not `http://host:port`.
    """
    try:
        parts = urlsplit(uri)
        good = parts.scheme == "http" and bool(parts.hostname) and parts.port is not None
    except ValueError:
        good = False
    if not good:
        raise VehicleError(f"{uri!r} is no ROS master.", hint="Use http://HOST:PORT, e.g. http://127.0.0.1:11311.")
    return uri
