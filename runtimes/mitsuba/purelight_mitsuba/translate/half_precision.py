"""How far a network with dense layers in half precision may be from its golden vectors."""

from __future__ import annotations

from typing import Any

import numpy as np

from purelight_format.networks import reference
from purelight_format.networks.golden import judge
from purelight_format.networks.kinds import KINDS
from purelight_format.networks.vectors import Vectors

ROUNDING = 2.0**-11  # Relative, to the nearest.
FLOOR = 8 * ROUNDING  # In the place of single precision's 1e-4.


def half_bound(
    model: bytes, vectors: Vectors, radiance_scale: float
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Tolerances of half-precision layers by the rule of golden vectors.

    Returns:
        Tolerances by output, and [N] whether they are narrow enough for a vector to say anything.
    """
    units = KINDS[vectors.network].units(radiance_scale)

    def evaluation(content: bytes) -> Any:
        return lambda inputs, dtype: reference.evaluate(content, inputs, dtype)

    judgement = judge(
        vectors.inputs, evaluation(model), units,
        shaking=lambda rng: evaluation(halved(model, rng)), floor=FLOOR,
    )  # fmt: skip
    wider = {name: judgement.tolerances[name] + vectors.tolerances[name] for name in units}
    return wider, judgement.fit


def halved(model: bytes, rng: np.random.Generator) -> bytes:
    """The network with every weight of its dense layers rounded to half precision, up or down."""
    import onnx
    from onnx import numpy_helper

    proto = onnx.load_from_string(model)
    dense = {i for n in proto.graph.node if n.op_type in ("Gemm", "MatMul") for i in n.input[1:]}
    for tensor in proto.graph.initializer:
        if tensor.name in dense:
            array = numpy_helper.to_array(tensor)
            moved = array * (1 + ROUNDING * rng.choice((-1, 1), array.shape))
            tensor.CopyFrom(numpy_helper.from_array(moved.astype(array.dtype), tensor.name))
    content: bytes = proto.SerializeToString()
    return content
