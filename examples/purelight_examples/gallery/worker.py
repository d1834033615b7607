"""One lamp or room of the gallery in a process of its own.

python -m purelight_examples.gallery.worker lamp|room NAME GALLERY SETTINGS

SETTINGS is JSON, see `settings.Settings`.
"""

from __future__ import annotations

import sys
from pathlib import Path

from purelight_examples.gallery.settings import Settings
from purelight_format import command

COMMAND = "purelight-gallery"


def main(argv: list[str] | None = None) -> int:
    """Run the stages that are not done; returns the exit code."""
    kind, name, gallery, settings = sys.argv[1:] if argv is None else argv
    return command.run(COMMAND, lambda: _work(kind, name, Path(gallery), settings))


def _work(kind: str, name: str, gallery: Path, settings: str) -> int:
    from purelight_mitsuba import platform

    mi = platform.use()
    mi.set_log_level(mi.LogLevel.Error)
    import drjit as dr

    from purelight_examples.gallery.lamp_job import LampJob
    from purelight_examples.gallery.room_job import RoomJob

    chosen = Settings.from_json(settings)
    dr.set_thread_count(chosen.threads)
    if kind == "lamp":
        LampJob(name, gallery / name, chosen)()
    else:
        RoomJob(name, gallery, chosen)()
    return 0


if __name__ == "__main__":
    sys.exit(main())
