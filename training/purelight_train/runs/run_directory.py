"""A run directory: the complete, resumable record of one training run.

config.json                 luminaire path and digest, preset (all sizes), seed, route, anchor
                            asked for, and what was tried for `auto`
description.json            sphere, flux, radiance scale, channels (`description.Description`)
surface.npz                 positions [V,3], triangles [T,3], triangle_flux [T,3] in W, finish [T,2]
finishes.json               what the indices of `finish` stand for, as in a manifest
kept/, kept.npz, kept.json  parts that are ordinary geometry (`fragment`), if there are any: a
                            scene of Mitsuba's, their meshes, their finishes
escaped.npz                 direction [M,3], weight [M,3]: a random part of the exit records,
                            scaled so that the weights sum to the flux
networks/NAME.safetensors   of each finished network (`trained`), and how its training went
checkpoints/                unfinished stages
previews/                   pictures
metrics.json                figures; written last, it names every network of the run
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any, TypeVar
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.torch import load_file, save
from torch import Tensor, nn

from purelight_format import atomic
from purelight_format.errors import PureLightError
from purelight_format.members.finishes import Finish, read_all
from purelight_format.members.manifest_reader import Reader
from purelight_format.usd.appearance_text import KeptPart
from purelight_train.light.description import Description
from purelight_train.presets import Preset

Module = TypeVar("Module", bound=nn.Module)


@dataclass(frozen=True)
class RunDirectory:
    """Paths and typed access to a run directory.

    Arguments:
        power: factor on the power of the traced lamp, which its description and so its networks
            have; what else the directory holds is as it was written.
    """

    path: Path
    power: float = 1.0

    @staticmethod
    def open(path: str | Path) -> RunDirectory:
        """Open a finished run.

        Raises:
            PureLightError: it is no run directory, or training has not finished.
        """
        run = RunDirectory(Path(path))
        if not (run.path / "config.json").is_file():
            raise PureLightError(f"{path}: no run directory (config.json is missing)")
        if not run.complete:
            raise PureLightError(f"{path}: training has not finished; run it again with --resume")
        return run

    # JSON and arrays

    def read_json(self, name: str) -> dict[str, Any]:
        """Contents of a JSON member."""
        try:
            data: dict[str, Any] = json.loads((self.path / name).read_text())
        except (OSError, ValueError) as error:
            raise PureLightError(f"{self.path / name}: unreadable: {error}") from None
        return data

    def write_json(self, name: str, data: dict[str, Any]) -> None:
        """Write a JSON member crash-safely."""
        atomic.write_bytes(self.path / name, (json.dumps(data, indent=2) + "\n").encode())

    def read_arrays(self, name: str) -> dict[str, NDArray[Any]]:
        """Arrays of an .npz member.

        Raises:
            PureLightError: it cannot be read.
        """
        try:
            with np.load(self.path / name, allow_pickle=False) as data:
                return {key: data[key] for key in data.files}
        except (OSError, EOFError, ValueError, BadZipFile) as error:
            raise PureLightError(f"{self.path / name}: unreadable: {error}") from None

    def write_arrays(self, name: str, **arrays: NDArray[Any]) -> None:
        """Write an .npz member crash-safely."""
        with atomic.replace_file(self.path / name) as file:
            np.savez(file, allow_pickle=False, **arrays)

    # What the run is about

    @property
    def config(self) -> dict[str, Any]:
        return self.read_json("config.json")

    @property
    def provenance(self) -> dict[str, Any]:
        """How the lamp was made, as a manifest says it."""
        config, about = self.config, self.description
        return {
            "scene": PurePath(config["luminaire"].replace("\\", "/")).name,
            "scene_digest": config["digest"],
            "seed": config["seed"],
            "route": config["route"],
            "preset": config["preset"]["name"],
            "anchor": config["preset"]["anchor"],
            "tried_anchors": list(config.get("tried_anchors", ())),
            "photons": about.paths,
        }

    @property
    def preset(self) -> Preset:
        return Preset.from_dict(self.config["preset"])

    @property
    def description(self) -> Description:
        try:
            found = Description.from_dict(self.read_json("description.json"))
        except (KeyError, TypeError):
            raise PureLightError(
                f"{self.path / 'description.json'}: made by another version; train again"
            ) from None
        return found.scaled(self.power)

    @property
    def finishes(self) -> tuple[Finish, ...]:
        """Of what the exit surface is made; empty in runs of before there were finishes.

        Raises:
            PureLightError: the file does not say.
        """
        return self._finishes("finishes.json")

    @property
    def kept(self) -> tuple[KeptPart, ...]:
        """The parts of the lamp that are ordinary geometry."""
        finishes = self._finishes("kept.json")
        arrays = self.read_arrays("kept.npz") if finishes else {}
        return tuple(
            KeptPart(
                finish.name, arrays[f"positions_{k}"], arrays[f"triangles_{k}"],
                arrays.get(f"normals_{k}"), finish,
            )
            for k, finish in enumerate(finishes)
        )  # fmt: skip

    def _finishes(self, name: str) -> tuple[Finish, ...]:
        if not (self.path / name).is_file():
            return ()
        reader = Reader(self.read_json(name), name)
        found = read_all(reader, "finishes")
        if reader.failed:
            raise PureLightError(f"{self.path}: {reader.findings.errors[0].message}")
        return found

    @property
    def complete(self) -> bool:
        """Whether the metrics are written, which comes last, and the networks they name there."""
        if not (self.path / "metrics.json").is_file():
            return False
        return all(map(self.finished, self.read_json("metrics.json").get("losses", ())))

    # Tensors

    def tensor_file(self, name: str) -> Path:
        return self.path / "networks" / f"{name}.safetensors"

    def finished(self, name: str) -> bool:
        """Whether the network of that name is trained."""
        return self.tensor_file(name).is_file()

    def save(self, name: str, module: nn.Module, record: dict[str, Any]) -> None:
        """Store a trained network, and beside it how its training went."""
        self.tensor_file(name).parent.mkdir(parents=True, exist_ok=True)
        self.write_json(f"networks/{name}.json", record)
        self.save_tensors(self.tensor_file(name), module.state_dict())

    def load(self, name: str, module: nn.Module) -> None:
        """Load a trained network's tensors into `module`.

        Raises:
            PureLightError: they are another network's, or cannot be read.
        """
        try:
            module.load_state_dict(load_file(self.tensor_file(name)))
        except (OSError, SafetensorError) as error:
            raise PureLightError(f"{self.tensor_file(name)}: unreadable: {error}") from None
        except RuntimeError:
            raise PureLightError(
                f"{self.tensor_file(name)}: made by another version; train again"
            ) from None
        module.eval()

    @staticmethod
    def save_tensors(path: Path, tensors: dict[str, Tensor]) -> None:
        """Write tensors to a safetensors file crash-safely."""
        path.parent.mkdir(parents=True, exist_ok=True)
        atomic.write_bytes(path, save({k: v.contiguous().cpu() for k, v in tensors.items()}))

    def network(self, name: str, kind: Callable[[Description, Preset], Module]) -> Module:
        """A trained network of the run, in evaluation mode on the CPU."""
        module = kind(self.description, self.preset)
        self.load(name, module)
        return module
