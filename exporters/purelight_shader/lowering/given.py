"""A node of a vetted graph with what is known of its inputs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from purelight_format.networks.operators import Tensor
from purelight_shader.lowering.value import Value
from purelight_shader.lowering.writer import Writer


@dataclass(frozen=True)
class Given:
    """A node.

    Arguments:
        op: its operator.
        values: its inputs that depend on the network's, by position; None for the others.
        constants: its inputs that do not, likewise.
        attributes: by name.
        outputs: types and shapes of what it gives.
    """

    op: str
    values: tuple[Value | None, ...]
    constants: tuple[np.ndarray | None, ...]
    attributes: dict[str, Any]
    outputs: tuple[Tensor, ...]

    def value(self, index: int = 0) -> Value:
        """An input that depends on the network's."""
        found = self.values[index]
        assert found is not None  # The profile demands it.
        return found

    def constant(self, index: int) -> np.ndarray | None:
        """An input that is a constant; None if it is left out."""
        return self.constants[index] if index < len(self.constants) else None

    def numbers(self, index: int) -> list[int]:
        """The numbers of an input that is a list of integers."""
        found = self.constant(index)
        assert found is not None
        return [int(number) for number in found.ravel()]

    def axis(self, axis: int) -> int:
        """An axis of the first value as one of a sample."""
        return int(axis) % (len(self.value().shape) + 1) - 1

    def operands(self, writer: Writer) -> list[Value]:
        """All inputs as values; constants lose an axis that stands for the rows."""
        rank = max(len(v.shape) for v in self.values if v is not None)
        found = []
        for given, data in zip(self.values, self.constants, strict=True):
            if given is not None:
                found.append(given)
            elif data is not None:
                found.append(writer.constant(data, data.shape[-rank:] if rank else ()))
        return found


Rule = Callable[[Writer, Given], list[Value]]
