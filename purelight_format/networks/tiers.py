"""Tiers of bundles: what the networks of one keep to, so that hosts know what they must afford."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from purelight_format.networks.model import load
from purelight_format.networks.operators import FLOAT, INT64, Tensor
from purelight_format.networks.profile import foretell
from purelight_format.networks.vectors import SIGNATURES, answers

SMALL = 4  # Elements that are no layer, but a colour or less.
MAP_CELLS = 256  # A network that answers so much at once is asked once for many directions.


@dataclass(frozen=True)
class Tier:
    """Bounds on every network of a bundle.

    Arguments:
        name: in the manifest.
        macs: multiply-adds of a network.
        map_macs: of one that answers at least `MAP_CELLS` numbers.
        floats: elements of all intermediates.
        multiple: of which the widths of hidden layers are.
        constants: elements of all initializers of one network.
    """

    name: str
    macs: int
    map_macs: int
    floats: int
    multiple: int
    constants: int


PORTABLE = Tier("portable", 5120, 16_384, 16_384, 16, 1 << 22)
TIERS = {PORTABLE.name: PORTABLE}


def most_macs(tier: Tier, network: str) -> int:
    """Multiply-adds that a network of this kind may take."""
    return tier.map_macs if answers(network) >= MAP_CELLS else tier.macs


def fault(tier: Tier, model: bytes, network: str) -> str:
    """What keeps a vetted network from being of a tier, in a few words; empty if nothing does.

    Arguments:
        model: ONNX bytes of the profile.
        network: its kind.
    """
    graph = load(model).graph
    tensors, (macs, floats, _) = foretell(graph, SIGNATURES[network].inputs)
    if macs > most_macs(tier, network):
        return f"{macs:,} multiply-adds"
    if floats > tier.floats:
        return f"{floats:,} values"
    constants = sum(t.size for t in tensors.values() if t.value is not None)
    if constants > tier.constants:
        return f"{constants:,} weights"
    return next(filter(None, (_node_fault(tier, node, tensors) for node in graph.node)), "")


def _node_fault(tier: Tier, node: Any, tensors: Mapping[str, Tensor]) -> str:
    if any(tensors[name].dtype == INT64 for name in node.output):
        return "integers of 64 bits"
    first = tensors[node.input[0]]
    if node.op_type == "Relu" and first.size > SMALL and first.size % tier.multiple:
        return f"a layer of {first.size}"
    if node.op_type == "Gather" and first.value is not None and first.dtype != FLOAT:
        return "a table of integers"
    return ""
