"""What an integrator prepares once per scene: its emitters, its lamps and their networks."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import mitsuba as mi

from purelight_mitsuba.lamps.emitter import PureLightEmitter
from purelight_mitsuba.lamps.table import Lamps
from purelight_mitsuba.transport.aimed import AimedLamps
from purelight_mitsuba.transport.engine import Engine
from purelight_mitsuba.transport.fused import Fused
from purelight_mitsuba.transport.light import group_names
from purelight_mitsuba.transport.media import MediaWarning, ignored
from purelight_mitsuba.transport.queries import Queries
from purelight_mitsuba.transport.queued import Queued
from purelight_mitsuba.transport.stock import StockEmitters
from purelight_mitsuba.transport.walk import NoLamps, Walk

LEAST_QUEUED = 3000  # Multiply-adds per shadow ray, from where on waiting pays.


@dataclass(frozen=True)
class Settings:
    """What an integrator is told about lamps (`integrator`)."""

    mode: str
    engine: str
    light_groups: bool


@dataclass(frozen=True)
class SceneParts:
    """A scene, taken apart.

    Arguments:
        key: Differs when the scene has to be prepared anew.
        stock: Mitsuba's own emitters.
        walk: Follows rays among the lamps.
        engine: Aims at them.
        groups: Names of the light groups to keep apart.
        lamps: If there are any.
        media: What to say about participating media, which are left out; empty if there are none.
    """

    key: tuple[Any, ...]
    stock: StockEmitters
    walk: Walk | NoLamps
    engine: Engine
    groups: tuple[str, ...]
    media: str
    lamps: Lamps | None = None


def prepare(scene: mi.Scene, settings: Settings, before: SceneParts | None) -> SceneParts:
    """Translates the networks and gathers the lamps, unless `before` still holds.

    Warns of participating media, once for a scene.

    Raises:
        PureLightError: If a bundle lacks a network that the mode needs, or is not valid now.
    """
    emitters = [e for e in scene.emitters() if isinstance(e, PureLightEmitter)]
    for emitter in emitters:
        emitter.refresh()
    # The scene itself would keep the integrator, and so itself, alive for ever; an emitter without
    # its shape would break all that asks every emitter of the process for its own.
    owners = (e if (shape := e.get_shape()) is None else shape for e in scene.emitters())
    state = ((e.placement, e.level, e.luminaire, e.light_group) for e in emitters)
    weights = (float(e.sampling_weight()) for e in scene.emitters())
    key = (settings, *owners, *weights, *state)
    if before is not None and before.key == key:
        return before
    groups = tuple(group_names(emitters)) if settings.light_groups else ()
    media = ignored(scene)
    if media and (before is None or before.media != media):
        warnings.warn(media, MediaWarning, stacklevel=2)
    stock = StockEmitters(scene)
    if not emitters:
        return SceneParts(key, stock, NoLamps(len(groups)), Engine(), groups, media)
    lamps = Lamps(emitters, scene, groups)
    walk, engine = _among(lamps, settings)
    return SceneParts(key, stock, walk, engine, groups, media, lamps)


def _among(lamps: Lamps, settings: Settings) -> tuple[Walk, Engine]:
    queued = _queues(settings, lamps)
    queries = Queries(lamps, fast=settings.mode == "fast", queued=queued)
    aimed = AimedLamps(lamps, queries)
    walk = Walk(lamps, queries, aimed)
    return walk, Queued(aimed, walk, lamps.luminaires) if queued else Fused(aimed)


def _queues(settings: Settings, lamps: Lamps) -> bool:
    """Whether shadow rays toward lamps wait in a queue."""
    if lamps.dark or settings.engine == "fused":
        return False
    names = ("fast_map",) if settings.mode == "fast" else ("sampler", "appearance")
    cost = max(sum(lamp.cost(name) for name in names) for lamp in lamps.luminaires)
    return settings.engine == "queued" or cost >= LEAST_QUEUED
