"""The packs that a name finds: our own towns, those in the user's maps folder, and OpenDRIVE files built on the way."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from chauffeur.concept import DataError
from chauffeur.worlds.town.build import build, sources_of
from chauffeur.worlds.town.pack import PACK_FILE, MapPack, maps_folder, read_pack

OWN_TOWNS: Final = Path(__file__).with_name("towns")
"""Our own towns, built: compressed packs that need no netconvert."""


def load(name_or_path: str | Path) -> MapPack:
    """A pack by name (a town of ours, or one built into the user's maps folder), the pack in a folder, or an `.xodr`.

    An OpenDRIVE file is built into the user's maps folder first, with the tables that lie beside it.

    Raises:
        DataError: There is none, or it cannot be read; says what to do.
        MissingExtraError: An OpenDRIVE file has to be built, and netconvert is not installed.
    """
    if Path(name_or_path).suffix == ".xodr":
        return build(sources_of(Path(name_or_path)))
    return read_pack(_found(name_or_path))


def has_pack(folder: Path) -> bool:
    """True if a folder holds a map pack."""
    return any((folder / one).is_file() for one in (PACK_FILE, PACK_FILE + ".gz"))


def packs() -> dict[str, Path]:
    """Folders of all packs that `load` finds by name: our own towns, and what lies in the user's maps folder."""
    return {
        path.parent.name: path.parent
        for root in (OWN_TOWNS, maps_folder())
        for path in sorted(root.glob(f"*/{PACK_FILE}*"))
    }


def _found(name_or_path: str | Path) -> Path:
    for folder in (Path(name_or_path), maps_folder() / name_or_path, OWN_TOWNS / name_or_path):
        if has_pack(folder):
            return folder
    raise DataError(
        f"There is no map pack {str(name_or_path)!r} in {maps_folder()}.",
        hint="List what there is: chauffeur maps list. Build one: chauffeur maps build FILE.xodr. "
        "Fetch CARLA's towns: chauffeur maps pull.",
    )
