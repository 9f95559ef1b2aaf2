"""CARLA's public towns: fetched by their owners' addresses, and nothing is kept that is not the file that is meant."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from chauffeur.concept import DataError

if TYPE_CHECKING:
    import httpx

HOST: Final = "https://raw.githubusercontent.com"
_MOST_BYTES: Final = 20_000_000
_TIMEOUT_S: Final = 60.0


@dataclass(frozen=True, slots=True)
class PublicFile:
    """A file of a town: where it is, what it is called here, and its SHA-256."""

    path: str
    name: str
    sha256: str


PUBLIC: Final[dict[str, tuple[PublicFile, ...]]] = {
    town: tuple(PublicFile(*file) for file in files)
    for town, files in json.loads(Path(__file__).with_name("public_towns.json").read_text(encoding="utf-8")).items()
}
"""Maps: CARLA's (code MIT, content CC-BY 4.0); stop lines and cycles: torchdrivesim (Apache-2.0); net: Scenic."""


def pull(town: str, folder: Path, *, host: str = HOST, told: Callable[[str], None] = lambda _: None) -> Path:
    """Fetch the files of a town into a folder, those that are not there already; returns its OpenDRIVE file.

    Raises:
        DataError: No such town, no answer, or another content than is meant; nothing of such a file is kept.
    """
    files = PUBLIC.get(town)
    if files is None:
        raise DataError(f"There is no public town {town!r}.", hint=f"There are {', '.join(PUBLIC)}.")
    import httpx

    try:
        folder.mkdir(parents=True, exist_ok=True)
        with httpx.Client(
            timeout=_TIMEOUT_S, follow_redirects=False, headers={"Accept-Encoding": "identity"}
        ) as client:
            for file in files:
                here = folder / file.name
                if here.is_file() and hashlib.sha256(here.read_bytes()).hexdigest() == file.sha256:
                    continue
                told(file.name)
                content = _fetched(client, f"{host}/{file.path}")
                found = hashlib.sha256(content).hexdigest()
                if found != file.sha256:
                    raise DataError(
                        f"{host}/{file.path} is another file than is meant: SHA-256 {found}, not {file.sha256}.",
                        hint="Get the town from your CARLA installation: chauffeur maps export.",
                    )
                part = here.with_name(here.name + ".part")
                part.write_bytes(content)
                part.replace(here)
    except OSError as error:
        raise DataError(f"Cannot keep {town} in {folder}: {error}.") from error
    return folder / files[0].name


def _fetched(client: httpx.Client, url: str) -> bytes:
    import httpx

    try:
        with client.stream("GET", url) as reply:
            if reply.status_code != 200:
                raise DataError(f"{url} answers {reply.status_code}.", hint="Build from a file: chauffeur maps build.")
            content = bytearray()
            for chunk in reply.iter_raw():  # asked for unpacked; what comes packed is another file
                content += chunk
                if len(content) > _MOST_BYTES:
                    raise DataError(f"{url} is larger than {_MOST_BYTES} bytes.")
            return bytes(content)
    except httpx.HTTPError as error:
        raise DataError(
            f"Cannot fetch {url}: {error}.",
            hint="Try again, or build from a file: chauffeur maps build.",
            retryable=True,
        ) from error
