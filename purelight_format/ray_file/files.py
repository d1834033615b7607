"""Ray files on disk, whatever their format."""

from __future__ import annotations

from pathlib import Path

from purelight_format.errors import PureLightError
from purelight_format.ray_file.mapped import Mapped
from purelight_format.ray_file.ray_file import RayFile
from purelight_format.ray_file.tm25 import MAGIC, read_tm25
from purelight_format.ray_file.tm25_writer import write_tm25
from purelight_format.ray_file.zemax import is_zemax, read_zemax, read_zemax_text, write_zemax

TM25_SUFFIXES = (".tm25ray", ".tm25")
ZEMAX_SUFFIXES = (".dat", ".sdf")
SUFFIXES = (*TM25_SUFFIXES, *ZEMAX_SUFFIXES)


def is_ray_file(path: Path) -> bool:
    """Whether a path is named like a ray file."""
    return path.suffix.lower() in SUFFIXES


def read_ray_file(path: Path) -> RayFile:
    """Reads a ray file; its content tells the format, not its name.

    Raises:
        PureLightError: If it cannot be read, or is no ray file that is known.
    """
    source = Mapped.open(path)
    if source.data[: len(MAGIC)] == MAGIC:
        return read_tm25(source)
    return read_zemax(source) if is_zemax(source) else read_zemax_text(source)


def write_ray_file(path: Path, file: RayFile) -> None:
    """Writes a ray file in the format that its name says.

    Raises:
        PureLightError: The name ends in none that is known, or the place cannot be written.
    """
    require_name(path)
    write = write_tm25 if path.suffix.lower() in TM25_SUFFIXES else write_zemax
    write(path, file)


def require_name(path: Path) -> None:
    """Refuses a name that tells no format.

    Raises:
        PureLightError: It ends in none that is known.
    """
    if not is_ray_file(path):
        raise PureLightError(f"{path}: a ray file's name must end in {', '.join(SUFFIXES)}")
