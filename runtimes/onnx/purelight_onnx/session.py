"""One network in ONNX Runtime: bounded threads, bounded memory, NumPy in and out."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import onnxruntime

from purelight_format.errors import PureLightError
from purelight_format.networks import denormals

Arrays = dict[str, np.ndarray]

MEMORY = 64 << 20  # Bytes of activations in one chunk.
DTYPES = {"tensor(float)": np.float32, "tensor(int32)": np.int32, "tensor(int64)": np.int64,
          "tensor(bool)": np.bool_}  # fmt: skip


class Session:
    """Evaluates a network in chunks of rows, one chunk per thread.

    A chunk of about 1,024 rows keeps the activations in the cache and the memory constant; a chunk
    runs on one thread, because two chunks on two threads are faster than one chunk on two. Denormal
    numbers count as zero in these threads, and the caller's are left as they are.

    Arguments:
        model: The bytes of an ONNX network whose tensors all have the row as first axis.
        name: What to call the network in errors.
        threads: How many chunks are evaluated at the same time.
        chunk: The rows of one chunk, at most.
        floats: Elements of all intermediates for one row, if they are known; a chunk has fewer rows
            where they would take more than `MEMORY`.

    Raises:
        PureLightError: If ONNX Runtime refuses the network.
    """

    def __init__(
        self,
        model: bytes,
        *,
        name: str = "network",
        threads: int = 1,
        chunk: int = 1024,
        floats: int = 0,
    ) -> None:
        if threads < 1 or chunk < 1:
            raise PureLightError(f"{name}: threads and chunk must be at least 1")
        self.name, self.threads = name, threads
        self.chunk = max(1, min(chunk, MEMORY // max(8 * floats, 1)))  # An int64 has eight bytes.
        self._session = _open(model, name)
        self._pool = ThreadPoolExecutor(threads, "purelight", denormals.flush)
        self._inputs = {i.name: (DTYPES[i.type], i.shape[1:]) for i in self._session.get_inputs()}
        self._outputs = {o.name: (DTYPES[o.type], o.shape[1:]) for o in self._session.get_outputs()}

    def __call__(self, inputs: Mapping[str, np.ndarray]) -> Arrays:
        """Evaluates any number of rows.

        Arguments:
            inputs: One array per input of the network, shapes [N, ...]; N may be zero.

        Returns:
            One array per output of the network, shapes [N, ...].

        Raises:
            PureLightError: If an input is missing, or its shape is not the network's, or ONNX
                Runtime cannot evaluate it.
        """
        feed = self._checked(inputs)
        rows = len(next(iter(feed.values())))
        result = {n: np.empty((rows, *shape), dtype) for n, (dtype, shape) in self._outputs.items()}

        def run(start: int) -> None:
            part = {name: array[start : start + self.chunk] for name, array in feed.items()}
            for array, value in zip(result.values(), self._run(list(result), part), strict=True):
                array[start : start + self.chunk] = value

        list(self._pool.map(run, range(0, rows, self.chunk)))
        return result

    def _run(self, names: list[str], feed: Arrays) -> list[np.ndarray]:
        try:
            values: list[np.ndarray] = self._session.run(names, feed)
        except Exception as error:  # ONNX Runtime's exceptions share no narrower base class.
            raise _refusal(self.name, "fails on it", error) from error
        return values

    def _checked(self, inputs: Mapping[str, np.ndarray]) -> Arrays:
        """Returns the inputs as contiguous arrays of the network's own types."""
        if set(inputs) != set(self._inputs):
            wanted = ", ".join(self._inputs)
            raise PureLightError(f"{self.name}: give exactly the inputs {wanted}")
        feed: Arrays = {
            name: np.ascontiguousarray(inputs[name], dtype)
            for name, (dtype, _) in self._inputs.items()
        }
        rows = {array.shape[:1] for array in feed.values()}
        for name, (_, shape) in self._inputs.items():
            if feed[name].shape[1:] != tuple(shape) or len(rows) != 1:
                size = ", ".join(["N", *map(str, shape)])
                raise PureLightError(f"{self.name}: {name} must have shape [{size}], N the same")
        return feed


def _open(model: bytes, name: str) -> onnxruntime.InferenceSession:
    """Opens a network from memory, so that nothing but these bytes is ever read."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    options.log_severity_level = 3
    options.add_session_config_entry("session.load_model_format", "ONNX")
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    try:
        return onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # ONNX Runtime's exceptions share no narrower base class.
        raise _refusal(name, "refuses it", error) from error


def _refusal(name: str, what: str, error: Exception) -> PureLightError:
    reason = (str(error).splitlines() or [type(error).__name__])[0][:200]
    return PureLightError(f"{name}: ONNX Runtime {what}: {reason}")
