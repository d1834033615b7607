"""Right size: a run like another with the smallest networks that are as near to its own as asked.

Student, sampler and fast map learn the run's student, which can be asked anywhere, without noise;
the transparency learns from light itself. A smaller network is kept if it does nearly as well as
the run's own. Networks that nothing here sizes stay as they are.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from torch import nn

from purelight_format.errors import PureLightError
from purelight_format.networks.tiers import PORTABLE
from purelight_train.presets import Preset
from purelight_train.runs.evaluation import as_function, fidelity
from purelight_train.runs.judging import judge_of, verdict
from purelight_train.runs.pipeline import Training, reopen
from purelight_train.runs.run_directory import RunDirectory
from purelight_train.sizes import portable
from purelight_train.sizes.sampling import Networks, SamplerSizes
from purelight_train.sizes.student import StudentSize, Trial
from purelight_train.sizes.transparency import TransparencySize

OF_THE_LARGER = ("report.html", "previews", "checkpoints")  # It shows other networks.


def right_size(
    run_path: Path, output: Path, target: float | None, device: str
) -> tuple[list[Trial], dict[str, int]]:
    """Write a run directory like `run_path` with the smallest networks that reach `target`.

    Arguments:
        target: None for the best networks of the portable tier instead.

    Returns:
        What was tried for the student, and the sizes of the other networks.

    Raises:
        PureLightError: `run_path` is no finished run, `output` exists, or no size is enough.
    """
    run = RunDirectory.open(run_path)
    if output.exists():
        raise PureLightError(f"{output}: exists already; choose another --output")
    if output.resolve().is_relative_to(run.path.resolve()):
        raise PureLightError(f"{output}: lies in the run that is read; choose another --output")
    training = reopen(run, Path(run.config["luminaire"]), device)
    search = StudentSize(training.lamp, training.student, training.stages)
    if target is None:
        rungs = portable.students(
            run.preset, training.lamp.surface, training.stages.rng("student", 4)
        )
        student, rung, trials = search.best(rungs)
    else:
        student, rung, trials = search(target)
    figures = fidelity(
        as_function(student, training.stages.device), training.lamp,
        training.stages.rng("metrics"),
    ) | {"flux_gain": student.gain.tolist()}  # fmt: skip
    preset, transparency, sampling = _others(training, rung.preset, target)
    if "verdict" in run.read_json("metrics.json"):  # It is about other networks
        figures["verdict"] = verdict(training, judge_of(training, student, **sampling)).to_json()
    output.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=output.parent, prefix=f".{output.name}") as folder:
        made = RunDirectory(Path(folder) / "run")
        shutil.copytree(run.path, made.path, ignore=shutil.ignore_patterns(*OF_THE_LARGER))
        made.write_json("config.json", run.config | {"preset": preset.to_dict()})
        made.write_json("metrics.json", run.read_json("metrics.json") | figures)
        tried = [trial.to_dict() for trial in trials]
        tier = None if target is not None else PORTABLE.name
        found = {"target": target, "tier": tier, "trials": tried, **sizes(preset)}
        made.write_json("sizes.json", found)
        modules: dict[str, nn.Module] = {"student": student, **transparency}
        modules |= {"sampler": sampling["sampler"], "fast_map": sampling["fast_map"]}
        for name, module in modules.items():
            made.save(name, module, run.read_json(f"networks/{name}.json"))
        made.path.rename(output)
    return trials, sizes(preset)


def _others(
    training: Training, preset: Preset, target: float | None
) -> tuple[Preset, dict[str, nn.Module], Networks]:
    """Transparency, sampler and fast map: small enough for `target`, or of the portable tier."""
    through, aimed = TransparencySize(training, target or 0), SamplerSizes(training, target or 0)
    if target is None:
        preset, transparency = through.portable(preset)
        preset, sampling = aimed.portable(preset)
    else:
        preset, transparency = through(preset)
        preset, sampling = aimed(preset)
    return preset, transparency, sampling


def sizes(preset: Preset) -> dict[str, int]:
    """What was found for the networks besides the student, for people."""
    return {
        "transparency_width": preset.transparency_network.width,
        "transparency_finest": preset.transparency_grid.finest,
        "sampler_width": preset.sampler_flow.network.width,
        "fast_map_width": preset.fast_map_network.width,
    }
