"""Append-only rows on disk: what every stage of a benchmark writes and every resume reads."""

from __future__ import annotations

import json
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from chauffeur.concept import DataError

Row = dict[str, Any]


class RowStore:
    """JSON lines keyed by one field; the last row of a key wins.

    A line cut off by a crash (only the last can be) is dropped when the file is opened, so a resume starts clean.
    """

    def __init__(self, path: Path, key: str) -> None:
        self.path = path
        self._key = key
        self.rows: dict[str, Row] = {}
        self._load()
        self._stream = None

    def _load(self) -> None:
        if not self.path.exists():
            return
        good = 0
        content = self.path.read_bytes()
        for number, line in enumerate(content.splitlines(keepends=True), start=1):
            try:
                row: Row = json.loads(line)
                key = str(row[self._key])
            except (ValueError, KeyError, TypeError) as error:
                if good + len(line) == len(content):
                    break
                raise DataError(
                    f"{self.path}, line {number}, is not a row of this run.",
                    hint="Delete that line (its item is then done again) or start in a new folder.",
                ) from error
            if not line.endswith(b"\n"):
                break
            good += len(line)
            self.rows[key] = row
        if good < len(content):
            with self.path.open("r+b") as stream:
                stream.truncate(good)

    def append(self, row: Row) -> None:
        """Write a row through to the file before returning."""
        if self._stream is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = self.path.open("a", encoding="utf-8")
        self._stream.write(json.dumps(row, ensure_ascii=False, separators=(",", ":")) + "\n")
        self._stream.flush()
        self.rows[str(row[self._key])] = row

    def close(self) -> None:
        """Close the file; the rows stay readable."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
