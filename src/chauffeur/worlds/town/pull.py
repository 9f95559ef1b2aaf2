"""CARLA's public towns: fetched by their owners' addresses, and nothing is kept that is not the file that is meant."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from chauffeur.concept import DataError

if TYPE_CHECKING:
    import httpx

HOST: Final = "https://raw.githubusercontent.com"
_SCENIC: Final = "BerkeleyLearnVerify/Scenic/7529c3e3/assets/maps/CARLA"
_PVAKARIS: Final = "pvakaris/av_safety_evaluation_project/8382504/data/maps/opendrive_format"
_DRIVESIM: Final = "inverted-ai/torchdrivesim/d019f8d3eb7687c0e06cb75f74a191066dc03e3f/torchdrivesim/resources/maps"
_MOST_BYTES: Final = 20_000_000
_TIMEOUT_S: Final = 60.0


@dataclass(frozen=True, slots=True)
class PublicFile:
    """A file of a town: where it is, what it is called here, and its SHA-256."""

    path: str
    name: str
    sha256: str


def _tables(town: str, stop_lines: str, cycles: str) -> tuple[PublicFile, ...]:
    folder = f"{_DRIVESIM}/carla_{town}"
    return tuple(
        PublicFile(f"{folder}/{name}", name, sha256)
        for name, sha256 in (
            (f"carla_{town}_stoplines.json", stop_lines),
            (f"carla_{town}_traffic_light_controller.json", cycles),
        )
    )


PUBLIC: Final[dict[str, tuple[PublicFile, ...]]] = {
    "Town01": (
        PublicFile(
            f"{_SCENIC}/Town01.xodr",
            "Town01.xodr",
            "97a7f6ac67812567e5c8ee0599cd823b23f80f30f3f97c502212e38b72e2b709",
        ),
        *_tables(
            "Town01",
            "51465e409533e2b568671d151fd4d866be63bcac0bcb27397b71f99a5ba365a1",
            "23f95efd58d24bf6295714e0ca2a39899a7e5e967d088aac0556db2c1abf44ed",
        ),
    ),
    "Town02": (
        PublicFile(
            f"{_SCENIC}/Town02.xodr",
            "Town02.xodr",
            "953c05f17def231239ffcadba3307628a82d0d335b67b4e29c3098f7aed1dd7d",
        ),
        *_tables(
            "Town02",
            "aa8d710ad6ceb78faac23a6152ef8cbd5e727caddbd758239b9cef9090724685",
            "9d792cbb78cb0c13b3fb3626eed73629c69b1cbba2fd767a75337b1412af4cae",
        ),
    ),
    "Town03": (
        PublicFile(
            f"{_PVAKARIS}/Town03.xodr",
            "Town03.xodr",
            "a711706c130c12b788538439fa326f95c92b2486cff810c3001e8c5e04098299",
        ),
        *_tables(
            "Town03",
            "605bcd8d641609fc006e77c0e618108c9032ede3feadd227e0e4b69e0424211c",
            "93653503bd3605f9c12ffdf5914cb4c88a56a93c5f6abf35a822c0c51941bd29",
        ),
    ),
    "Town04": (
        PublicFile(
            f"{_SCENIC}/Town04.xodr",
            "Town04.xodr",
            "4dddd1560ab7812b0e89cd4a523d8b6f2b93947eafb496d9eeb83cc772116c85",
        ),
        *_tables(
            "Town04",
            "62c3078464b218fe460bd6bd3ee9f109065fb151c3f58889443b81ae69e95561",
            "4060751ec1a12ba5c86ac4505f9d5f208c2e4eb0b71cd190be2f6ba6a93b611c",
        ),
    ),
    "Town05": (
        PublicFile(
            f"{_PVAKARIS}/Town05.xodr",
            "Town05.xodr",
            "d01a356d8f5bfb2e508347d08cfaa09f4f395062187038ba8b4212141e354e37",
        ),
        PublicFile(
            f"{_SCENIC}/Town05.net.xml",
            "Town05.net.xml",
            "ca759f664f529d6b925d2a83b2cfb7f405450852b0028a50edd0254c4c42b276",
        ),
    ),
    "Town06": (
        PublicFile(
            f"{_SCENIC}/Town06.xodr",
            "Town06.xodr",
            "a90b613175fa837fdc128ddfaf5ddad25797b128fdbd8cd945974bc21a60496e",
        ),
        *_tables(
            "Town06",
            "b349b02bbd424e54b3eb1544ad93b030c4c772b4b9122bdfa8e7d42d6edb381a",
            "b43658d65ed7357d43e478472acc853fdedb6c2dae0f6287f60081df782ab2c3",
        ),
    ),
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
