"""`purelight-blender`: the extension as a zip that Blender installs; the same code, the same bytes.

The parts of PureLight that it needs lie in it as a wheel, which Blender unpacks for its own Python.
"""

from __future__ import annotations

import base64
import hashlib
import io
import re
import zipfile
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path

from purelight_format import atomic, command

COMMAND = "purelight-blender"
NEEDED = ("purelight_format", "purelight_shader", "purelight_cpp")
HERE = Path(__file__).parent
LEFT_OUT = (Path(__file__).name,)
SUFFIXES = (".py", ".toml", ".in", ".json", ".usda", ".h", ".html", ".typed")
OLDEST = (1980, 1, 1, 0, 0, 0)  # The first time that a zip can tell.
WHEEL = "Wheel-Version: 1.0\nGenerator: purelight\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
METADATA = "Metadata-Version: 2.1\nName: purelight\nVersion: {version}\n"


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns 0, or 2 after a one-line error."""
    return command.run(COMMAND, lambda: _write(_parser().parse_args(argv).output))


def _write(path: Path) -> int:
    atomic.check_file(path)
    data = extension()
    atomic.write_bytes(path, data)
    print(f"{path}  {len(data) / 1e6:.2f} MB; in Blender: Preferences > Get Extensions > ")
    print("Install from Disk, or drop the file into Blender's window")
    return 0


def _parser() -> command.Parser:
    parser = command.Parser(prog=COMMAND, description=__doc__)
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.zip")
    return parser


def extension() -> bytes:
    """The zip."""
    files = {name: data for name, data in sources(HERE).items() if name not in LEFT_OUT}
    wheel = named_wheel(files["blender_manifest.toml"].decode())
    return archive({**files, wheel: _wheel(wheel)})


def named_wheel(manifest: str) -> str:
    """Where the manifest says that the wheel lies."""
    found = re.search(
        r'^wheels = \["\./(wheels/purelight-[\d.]+-py3-none-any\.whl)"\]', manifest, re.M
    )
    assert found is not None
    return found[1]


def _wheel(name: str) -> bytes:
    files: dict[str, bytes] = {}
    for package in NEEDED:
        folder = Path(str(import_module(package).__file__)).parent
        files |= {f"{package}/{inner}": data for inner, data in sources(folder).items()}
    version = Path(name).name.split("-")[1]
    about = f"purelight-{version}.dist-info"
    files[f"{about}/METADATA"] = METADATA.format(version=version).encode()
    files[f"{about}/WHEEL"] = WHEEL.encode()
    lines = [f"{path},{_digest(data)},{len(data)}" for path, data in sorted(files.items())]
    record = f"{about}/RECORD"
    return archive({**files, record: "\n".join([*lines, f"{record},,", ""]).encode()})


def sources(folder: Path) -> dict[str, bytes]:
    """The files of a package by their paths in it, without what Python leaves there."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.suffix in SUFFIXES and "__pycache__" not in path.parts
    }


def _digest(data: bytes) -> str:
    text = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode()
    return "sha256=" + text.rstrip("=")


def archive(files: Mapping[str, bytes]) -> bytes:
    """A zip of files, sorted, without times, and stored: zlibs differ in what they make."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as file:
        for name, data in sorted(files.items()):
            entry = zipfile.ZipInfo(name, OLDEST)
            entry.create_system, entry.external_attr = 3, 0o644 << 16
            file.writestr(entry, data)
    return buffer.getvalue()


if __name__ == "__main__":
    raise SystemExit(main())
