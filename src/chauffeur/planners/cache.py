"""Replies kept on disk under the exact request that brought them about.

The key is a hash over model, endpoint, every message and every sampling parameter, so a changed prompt never meets an
old answer. Neither the request nor any secret is stored, only the reply. Caching is a convenience: no fault of the
disk ever fails a plan.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

_log = logging.getLogger(__name__)

_VERSION = 1
_FOLDER = f"replies-v{_VERSION}"
_MAX_ENTRY_BYTES = 8_000_000


@dataclass(frozen=True, slots=True)
class Completion:
    """One complete reply of a model.

    Attributes:
        text: The words, capped.
        finish: Why the model stopped: `stop`, `length` (token limit), `capped` (our limit), or the server's own word.
        prompt_tokens: Tokens in, as the server counted; 0 when it did not say.
        completion_tokens: Tokens out.
        model: Model id the server says it used; empty when it did not say.
    """

    text: str
    finish: str
    prompt_tokens: int = 0
    completion_tokens: int = 0
    model: str = ""


def default_cache_dir() -> Path:
    """`$XDG_CACHE_HOME/chauffeur`, or `~/.cache/chauffeur`."""
    root = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(root) if root else Path.home() / ".cache") / "chauffeur"


def content_key(parts: Mapping[str, Any]) -> str:
    """SHA-256 over JSON values, independent of the order in which names were given."""
    text = json.dumps(parts, sort_keys=True, ensure_ascii=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _checksum(completion: Completion) -> str:
    return content_key(asdict(completion))


class ReplyCache:
    """Replies as one JSON file each, in a folder only its owner can read.

    Args:
        root: Folder to keep the cache's own folder in.
    """

    def __init__(self, root: Path) -> None:
        self.folder = root / _FOLDER

    def _path(self, key: str) -> Path:
        return self.folder / key[:2] / f"{key}.json"

    def get(self, key: str) -> Completion | None:
        """The reply under a key; None when there is none, or when what is there cannot be trusted."""
        path = self._path(key)
        completion = None
        try:
            with path.open("rb") as file:
                entry = json.loads(file.read(_MAX_ENTRY_BYTES))
            candidate = Completion(**entry["reply"])
            if entry["key"] == key and entry["sha256"] == _checksum(candidate):
                completion = candidate
            problem = "its checksum differs"
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
            problem = type(error).__name__
        if completion is None:
            _log.warning("kept reply %s is unusable (%s) and will be replaced", path, problem)
        return completion

    def put(self, key: str, completion: Completion) -> None:
        """Keep a reply. The file appears whole or not at all, also when several processes write the same one."""
        path = self._path(key)
        entry = {"key": key, "sha256": _checksum(completion), "reply": asdict(completion)}
        try:
            self._make_private(path.parent)
            descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".tmp")
            temporary = Path(name)
            try:
                with os.fdopen(descriptor, "w", encoding="utf-8") as file:
                    json.dump(entry, file)
                temporary.replace(path)
            except BaseException:
                temporary.unlink(missing_ok=True)
                raise
        except (OSError, ValueError) as error:
            _log.warning("reply not cached in %s: %s", self.folder, error)

    def clear(self) -> int:
        """Erase every kept reply; returns how many there were."""
        count = 0
        for path in self.folder.glob("*/*.json"):
            path.unlink(missing_ok=True)
            count += 1
        return count

    def _make_private(self, folder: Path) -> None:
        # Only folders of our own are narrowed: the root may be a shared place such as /tmp.
        self.folder.parent.mkdir(parents=True, exist_ok=True)
        for own in (self.folder, folder):
            own.mkdir(mode=0o700, exist_ok=True)
            if own.stat().st_mode & 0o077:
                own.chmod(0o700)


def endpoint_key(base_url: str, model: str, messages: Sequence[Mapping[str, Any]], sampling: Mapping[str, Any]) -> str:
    """Key of one request to one endpoint.

    Args:
        base_url: Address of the endpoint; host, port and path count.
        model: Model asked for.
        messages: The whole conversation.
        sampling: Every parameter that can change the reply.
    """
    return content_key(
        {
            "version": _VERSION,
            "endpoint": base_url,
            "model": model,
            "messages": [dict(message) for message in messages],
            "sampling": dict(sampling),
        }
    )
