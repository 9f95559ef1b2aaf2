"""The XML-RPC side of a ROS 1 node (the "slave API"): what a master and other nodes may ask us.

Source: wiki.ros.org/ROS/Slave_API. ROS 1 has no authentication: whoever reaches the port can ask. Nothing that can be
asked here changes what is published; `shutdown` ends publishing, as it ends any node.
"""

from __future__ import annotations

import os
import socketserver
import threading
from collections.abc import Callable
from typing import Any, Final
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

LARGEST_REQUEST: Final = 256 * 1024
"""Bytes of a request; the longest real one lists a topic's publishers."""

MOST_REQUESTS: Final = 16
"""Connections served at once."""

Answer = list[Any]


class _Handler(SimpleXMLRPCRequestHandler):
    protocol_version = "HTTP/1.1"  # as rospy's: C++ nodes keep the connection
    timeout = 10.0  # a request that does not come, or an idle connection

    def do_POST(self) -> None:  # noqa: N802 - http.server's name
        """Refuse what is too long before it is read."""
        length = self.headers.get("content-length", "")
        if not length.isdecimal() or int(length) > LARGEST_REQUEST:
            self.close_connection = True
            self.send_error(413 if length.isdecimal() else 411)
            return
        super().do_POST()

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing: what matters is in the notes."""


class _Server(socketserver.ThreadingMixIn, SimpleXMLRPCServer):
    daemon_threads = True
    block_on_close = False
    address_family = 2  # AF_INET: ROS 1 knows no other

    def __init__(self, address: tuple[str, int]) -> None:
        self._free = threading.BoundedSemaphore(MOST_REQUESTS)
        super().__init__(address, _Handler, logRequests=False, allow_none=True)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Serve it in a thread of its own, if one is free."""
        if self._free.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Serve it, and free the thread."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A connection that broke is no event."""


class NodeServer:
    """Serves the slave API on a free port of one address."""

    def __init__(
        self,
        host: str,
        master_uri: str,
        *,
        request_topic: Callable[[str], int | None],
        publisher_update: Callable[[str, list[str]], None],
        shutdown: Callable[[str], None],
        publications: Callable[[], list[list[str]]],
        subscriptions: Callable[[], list[list[str]]],
        connections: Callable[[], list[Any]],
    ) -> None:
        """Start serving.

        Args:
            host: Address to bind, and none but it; also what is told to others.
            master_uri: What `getMasterUri` answers.
            request_topic: TCP port where a topic is served, or None.
            publisher_update: Told of a topic's publishers, as the master names them.
            shutdown: Told why, when we are asked to end.
            publications, subscriptions: [[topic, type], ...].
            connections: What `getBusInfo` answers.

        Raises:
            OSError: The address is not one of this machine.
        """
        self._server = _Server((host, 0))
        port: int = self._server.server_address[1]
        self.uri: Final = f"http://{host}:{port}/"

        def answer_topic(caller: str, topic: str, protocols: Any) -> Answer:
            del caller
            port = request_topic(topic)
            if port is None:
                return [-1, f"{topic} is not published here", 0]
            offered = [one[0] for one in protocols if isinstance(one, list) and one]
            if "TCPROS" not in offered:
                return [0, "only TCPROS is spoken here", 0]
            return [1, "ready", ["TCPROS", host, port]]

        def answer_update(caller: str, topic: str, publishers: Any) -> Answer:
            del caller
            if not (isinstance(publishers, list) and all(isinstance(one, str) for one in publishers)):
                return [-1, "publishers are a list of URIs", 0]
            publisher_update(topic, publishers)
            return [1, "", 0]

        def answer_shutdown(caller: str, reason: str = "") -> Answer:
            shutdown(f"{reason or 'no reason given'} (from {caller})")
            return [1, "shutdown", 0]

        def says(value: Callable[[], Any]) -> Callable[..., Answer]:
            return lambda *_: [1, "", value()]

        answers: dict[str, Callable[..., Answer]] = {
            "requestTopic": answer_topic,
            "publisherUpdate": answer_update,
            "shutdown": answer_shutdown,
            "paramUpdate": says(lambda: 0),
            "getPid": says(os.getpid),
            "getMasterUri": says(lambda: master_uri),
            "getPublications": says(publications),
            "getSubscriptions": says(subscriptions),
            "getBusInfo": says(connections),
            "getBusStats": says(lambda: [[], [], []]),
        }
        for name, answer in answers.items():
            self._server.register_function(answer, name)
        self._thread = threading.Thread(
            target=self._server.serve_forever, kwargs={"poll_interval": 0.05}, name="ros1-slave", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Stop serving."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join(timeout=1.0)
