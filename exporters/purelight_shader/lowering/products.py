"""Matrix products, in groups of four outputs."""

from __future__ import annotations

import numpy as np

from purelight_shader.form.elements import Kind
from purelight_shader.form.statements import Product
from purelight_shader.form.store import FOUR
from purelight_shader.lowering import bounds
from purelight_shader.lowering.given import Given, Rule
from purelight_shader.lowering.value import Value
from purelight_shader.lowering.writer import Writer, load_all

WIDEST = 8


def _gemm(writer: Writer, node: Given) -> list[Value]:
    weight, bias = node.constants[1:]
    assert weight is not None
    return [_product(writer, node, weight, bias)]


def _matmul(writer: Writer, node: Given) -> list[Value]:
    weight = node.constant(1)
    assert weight is not None
    return [_product(writer, node, weight.T, None)]


def _product(writer: Writer, node: Given, weight: np.ndarray, bias: np.ndarray | None) -> Value:
    """`weight x + bias`, weight [out, in]; every input is computed once."""
    given, outputs = node.value(), len(weight)
    fours = -(-outputs // FOUR)
    blocks = -(-fours // WIDEST)
    width = -(-fours // blocks)
    if blocks > 1 and not given.is_cheap:
        given = writer.written(given)
    padded = blocks * width * FOUR
    target = writer.array(Kind.FLOAT, padded)
    columns = np.pad(weight.T, ((0, 0), (0, padded - outputs)))
    packed = columns.reshape(len(columns), blocks, width, FOUR).transpose(1, 0, 2, 3)
    offset = None if bias is None else np.pad(bias, (0, padded - outputs))
    parts = tuple(zip(given.extents, given.pieces, strict=True))
    writer.add(
        Product(
            target, parts, writer.store.add(packed, Kind.FLOAT, buffered=True),
            None if offset is None else writer.store.add(offset, Kind.FLOAT, buffered=True),
            blocks, width,
        )
    )  # fmt: skip
    limits = bounds.product(given.bounds, weight, 0.0 if bias is None else bias)
    shape = (outputs,)
    return Value.whole(node.outputs[0].dtype, shape, load_all(target, shape), limits)


RULES: dict[str, Rule] = {"Gemm": _gemm, "MatMul": _matmul}
