"""Nodes of a tree, by short words."""

from __future__ import annotations

from typing import Any


class Tree:
    """A node tree that is being built from the left to the right.

    Arguments:
        tree: of Blender's.
    """

    def __init__(self, tree: Any) -> None:
        self.tree = tree
        self._column = 0

    def add(self, kind: str, label: str = "", **values: Any) -> Any:
        """A node `ShaderNode<kind>` with these properties."""
        node = self.tree.nodes.new(kind if kind.startswith("Node") else f"ShaderNode{kind}")
        node.label = label
        node.location = (220 * (self._column // 3), -260 * (self._column % 3))
        self._column += 1
        for name, value in values.items():
            setattr(node, name, value)
        return node

    def link(self, source: Any, target: Any) -> None:
        """Joins an output to an input."""
        self.tree.links.new(source, target)

    def vector(self, operation: str, a: Any, b: Any) -> Any:
        """The output of a vector operation on two outputs."""
        node = self.add("VectorMath", operation=operation)
        self.link(a, node.inputs[0])
        self.link(b, node.inputs[1])
        return node.outputs[0]

    def mixed(self, factor: Any, a: Any, b: Any) -> Any:
        """The output that is `b` where the factor is 1.

        A factor whose node does nothing in a renderer counts as 0: that is the input's own value.
        """
        node = self.add("Mix", data_type="VECTOR", clamp_factor=True)
        inputs = {socket.identifier: socket for socket in node.inputs}
        inputs["Factor_Float"].default_value = 0.0
        self.link(factor, inputs["Factor_Float"])
        self.link(a, inputs["A_Vector"])
        self.link(b, inputs["B_Vector"])
        return next(s for s in node.outputs if s.identifier == "Result_Vector")

    def constant(self, values: Any, label: str) -> Any:
        """The output of three fixed numbers."""
        node = self.add("CombineXYZ", label)
        for socket, value in zip(node.inputs, values, strict=True):
            socket.default_value = float(value)
        return node.outputs[0]
