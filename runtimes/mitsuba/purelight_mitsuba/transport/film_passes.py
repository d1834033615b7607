"""One picture by several renderings of the same film, so that memory does not grow with samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import drjit as dr
import mitsuba as mi

Render = Callable[[int, mi.UInt32], Any]


def sample_counts(total: int, most: int, step: int = 0) -> list[int]:
    """Splits samples into nearly equal counts of at most `most`, and of at least one.

    Arguments:
        step: Of which each is to be a multiple, if the total is one.
    """
    step = step if step > 0 and total % step == 0 else 1
    whole, most = total // step, most // step
    passes = max(1, -(-whole // max(1, most)))
    return [step * (whole // passes + (index < whole % passes)) for index in range(passes)]


def accumulate(
    render: Render, film: mi.Film, channels: Sequence[str], counts: Sequence[int], seed: Any
) -> mi.TensorXf:
    """Adds renderings up before the film divides by weights, and leaves the film as one would.

    Arguments:
        render: Renders the film with a number of samples and a seed.
        channels: Names of the film's further channels.
        counts: Samples of each rendering.

    Returns:
        The developed picture.
    """
    total = None
    for index, count in enumerate(counts):
        render(count, mi.sample_tea_32(mi.UInt32(seed), mi.UInt32(index))[0])
        part = film.develop(raw=True)
        total = part if total is None else total + part
        dr.eval(total)
    film.prepare(list(channels))
    block = film.create_block()
    block.tensor()[:] = total
    film.put_block(block)
    return film.develop()
