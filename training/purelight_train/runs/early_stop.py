"""Early stop: an optimisation ends once the error on held-out data has stopped falling."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

from purelight_format import atomic

PATIENCE = 8  # checks, of a hundred in a whole run
COOLING = 0.1  # of all steps: the learning rate falls to a hundredth before the end


@dataclass
class _State:
    """What a resumed run must know: the best error, when it was found, and the last check."""

    best: float = math.inf
    found: int = 0
    checked: int = 0
    cooling: int | None = None


class EarlyStop:
    """Cuts a schedule of learning rates short, but not its cooling down.

    At a high learning rate an error stays above what the weights could reach, so an optimisation
    that stopped on the spot would throw away what the cooling brings. Once `PATIENCE` checks have
    brought no new best, the rate falls geometrically over `COOLING` of the steps, and that is all.

    Arguments:
        error: the error on held-out data now; a value that is not finite is no improvement.
        file: keeps the state of unfinished work, beside the checkpoint.
        gain: least fall of the error that counts, in its own unit.
    """

    def __init__(self, error: Callable[[], float], file: Path, gain: float = 1e-3) -> None:
        self.error, self.file, self.gain = error, file, gain
        self.state = _State(**json.loads(file.read_text())) if file.is_file() else _State()

    def check(self, step: int, steps: int) -> None:
        """Measure the error after `step` of `steps`; steps that a resumed run repeats count once.

        Called a hundred times in a whole run.
        """
        state = self.state
        if step <= state.checked or state.cooling is not None:
            return
        error, state.checked = self.error(), step
        if error < state.best - self.gain:
            state.best, state.found = error, step
        if step - state.found >= PATIENCE * steps / 100:
            state.cooling = step
        text = json.dumps(asdict(state))
        self.file.parent.mkdir(parents=True, exist_ok=True)
        atomic.write_bytes(self.file, text.encode())

    def factor(self, step: int, steps: int) -> float:
        """What the learning rate of a step is to be multiplied by; zero once all is done."""
        if self.state.cooling is None or step < self.state.cooling:
            return 1.0
        part = (step - self.state.cooling) / max(1, round(COOLING * steps))
        return float(0.01**part) if part < 1 else 0.0

    def done(self) -> None:
        """Forget unfinished work."""
        self.file.unlink(missing_ok=True)
