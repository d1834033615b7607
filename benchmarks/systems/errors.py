"""How far a frame is from its task's truth, and how noisy it is."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.systems.protocol import Frame, Subject
from benchmarks.systems.tasks.task import Figures, JudgedTask
from benchmarks.systems.tasks.truth import Truth
from purelight_format.errors import PureLightError
from purelight_train.truth.metrics import MSE_FLOOR, Comparison
from purelight_train.truth.picture import Picture


def picture(earlier: Frame, frame: Frame) -> Picture:
    """A frame as the mean of two independent parts: the earlier frame, and what came since.

    The standard error follows from how far the parts, of n and m samples, are apart: the variance
    of the mean is that square times n m / (n + m)², in the mean.

    Raises:
        PureLightError: the frames do not grow, or have different sizes.
    """
    n, m = earlier.samples, frame.samples - earlier.samples
    if n < 1 or m < 1 or earlier.image.shape != frame.image.shape:
        raise PureLightError("its frames do not go on from each other; a System has to see to it")
    since = (frame.samples * frame.image - n * earlier.image) / m
    error = np.abs(earlier.image - since) * math.sqrt(n * m) / (n + m)
    return Picture(frame.image, (earlier.image, since), error)


def measure(subject: Subject, task: JudgedTask, seen: Picture, truth: Truth) -> Figures:
    """All figures of a picture, JSON-ready: `Comparison`'s, the task's, and these.

    Returns:
        `relative_variance`: mean of the picture's own variance over R² + (0.1 mean R)²;
        `relative_error`: relMSE with the variance of the truth alone taken out, what the picture
        with its noise would have beside a perfect truth; `mean_noise`: standard error of `mean`,
        of both, the channels of a pixel taken to vary together, as paths carry all.
        Only `dark` where no light falls on what is judged.

    Raises:
        PureLightError: the picture has another size than the truth.
    """
    if seen.image.shape != truth.picture.image.shape:
        raise PureLightError(
            f"its picture is {seen.image.shape}, the task's {truth.picture.image.shape}"
        )
    mask, reference = truth.mask, truth.picture.image
    level = float(reference[mask].mean()) if mask.any() else 0.0
    if not level > 0:
        return {"dark": True}
    compared = Comparison(seen, truth.picture, mask).to_dict()
    weight = 1 / (reference[mask] ** 2 + (MSE_FLOOR * level) ** 2)
    noise = [float((p.error[mask] ** 2 * weight).mean()) for p in (seen, truth.picture)]
    apart = [float(np.sqrt((p.error[mask].sum(-1) ** 2).sum())) for p in (seen, truth.picture)]
    return {
        **compared,
        "relative_variance": noise[0],
        "relative_error": max(compared["relative_mse"] - noise[1], 0.0),
        "truth_variance": noise[1],
        "mean_noise": math.hypot(*apart) / (3 * mask.sum() * level),
        **task.figures(subject, seen, truth),
    }
