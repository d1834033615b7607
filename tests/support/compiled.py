"""Networks as compiled C++: many at once, so that one run of each compiler serves many tests."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_format.networks.vectors import Signature
from purelight_shader import library
from purelight_shader.form.elements import Kind
from purelight_shader.form.statements import Program
from purelight_shader.form.store import Store
from purelight_shader.lowering.network import lower
from purelight_shader.targets import slang_module, slangc
from purelight_shader.targets.slang_module import Module

DRIVER = """\
#include "module.cpp"
#include <cstdio>
#include <vector>
template<typename T> std::vector<T> read(const char* name)
{
    std::vector<T> numbers;
    FILE* file = fopen(name, "rb");
    T number;
    while (fread(&number, sizeof number, 1, file) == 1) numbers.push_back(number);
    fclose(file);
    return numbers;
}
int main()
{
    auto floats = read<float>("floats.bin");
    auto integers = read<int32_t>("integers.bin");
    auto asked = read<float>("asked.bin");
    std::vector<float> answers(ROWS * OUTPUTS);
    GlobalParams_0 parameters;
    BINDINGS
    parameters.test_in_0.data = asked.data();
    parameters.test_in_0.count = asked.size();
    parameters.test_out_0.data = answers.data();
    parameters.test_out_0.count = answers.size();
    ComputeVaryingInput all{};
    all.endGroupID = {ROWS, 1, 1};
    selftest(&all, nullptr, &parameters);
    FILE* file = fopen("answers.bin", "wb");
    fwrite(answers.data(), sizeof(float), answers.size(), file);
    return fclose(file);
}
"""


def require_compilers() -> None:
    """Skips the test where there is no Slang or C++ compiler."""
    for find in (slangc.find, library.compiler):
        try:
            find()
        except PureLightError as error:
            pytest.skip(str(error))


@dataclass(frozen=True)
class Network:
    """A network to compile.

    Arguments:
        model: ONNX bytes.
        signature: its inputs and outputs.
        limits: what its inputs are said to be at least and at most.
    """

    model: bytes
    signature: Signature
    limits: tuple[float, float] = (-4.0, 4.0)


class Batch:
    """Networks translated together.

    Arguments:
        networks: by name.
        written: constants of at most so many elements stand in the code.
    """

    def __init__(self, networks: Mapping[str, Network], written: int = 16) -> None:
        self.store = Store(written)
        self.programs = {name: self._lower(name, network) for name, network in networks.items()}
        names = {name: f"f{k}" for k, name in enumerate(networks)}
        self.module: Module = slang_module.module(self.programs, names, "test")

    def _lower(self, name: str, network: Network) -> Program:
        limits = {
            k: tuple(np.full(shape, end) for end in network.limits)
            for k, shape in network.signature.inputs.items()
        }
        return lower(network.model, name, network.signature, limits, self.store)  # type: ignore[arg-type]

    def answers(
        self, rows: Mapping[str, Sequence[np.ndarray]], folder: Path, *flags: str
    ) -> dict[str, np.ndarray]:
        """What the compiled networks answer, all outputs side by side: [N, ...] by name.

        Arguments:
            rows: inputs [N, ...] of each network.
            flags: of the C++ compiler.
        """
        asked = [self._asked(k, rows[name]) for k, name in enumerate(self.programs)]
        table = np.concatenate(asked)
        room = slang_module.outputs(self.programs)
        found = self._run(table, room, folder, flags)
        sizes = {k: sum(port.array.size for port in p.outputs) for k, p in self.programs.items()}
        ends = np.cumsum([len(part) for part in asked])[:-1]
        parts = zip(sizes.items(), np.split(found, ends), strict=True)
        return {name: part[:, :size] for (name, size), part in parts}

    def _asked(self, index: int, arrays: Sequence[np.ndarray]) -> np.ndarray:
        flat = np.concatenate([a.reshape(len(a), -1) for a in arrays], 1)
        width = slang_module.inputs(self.programs) - 1
        padded = np.pad(flat, ((0, 0), (0, width - flat.shape[1])))
        return np.pad(padded, ((0, 0), (1, 0)), constant_values=index).astype(np.float32)

    def _run(self, table: np.ndarray, room: int, folder: Path, flags: Sequence[str]) -> np.ndarray:
        require_compilers()
        text = slangc.compile_text(self.module.text + self.module.kernel, "cpp", stage="compute")
        (folder / "module.cpp").write_text(text)
        bindings = "\n".join(
            f"parameters.test_{name}_0.data = (Vector<{kind}, 4>*){name}.data();"
            for name, kind in (("floats", "float"), ("integers", "int32_t"))
            if f"> test_{name}_0;" in text
        )
        driver = DRIVER.replace("BINDINGS", bindings).replace("ROWS", str(len(table)))
        (folder / "driver.cpp").write_text(driver.replace("OUTPUTS", str(room)))
        self.store.buffer(Kind.FLOAT).tofile(folder / "floats.bin")
        self.store.buffer(Kind.INT).tofile(folder / "integers.bin")
        table.tofile(folder / "asked.bin")
        compile_it = [*library.compiler(), "-std=c++17", "-w", *(flags or ("-O1",))]
        subprocess.run([*compile_it, "driver.cpp", "-o", "driver"], cwd=folder, check=True)
        subprocess.run(["./driver"], cwd=folder, check=True)
        return np.fromfile(folder / "answers.bin", np.float32).reshape(len(table), room)
