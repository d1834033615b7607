"""A copy of this package's modules for each of Mitsuba's variants.

A class that derives from one of Mitsuba's belongs to the variant in which its module was imported,
and so does every module that holds that class. Hence none is reloaded: each variant has modules of
its own, which import each other as usual, and another variant's are put aside meanwhile.
"""

from __future__ import annotations

import sys
from types import ModuleType

Modules = dict[str, ModuleType]


class ModuleSets:
    """The modules of a package, by variant.

    What is imported while no variant is set belongs to the first one. A name that a caller has
    imported stays that of its variant, and coming back to the variant restores the same objects.

    Arguments:
        package: Its name. Modules of it that are loaded by now are shared by all variants.
    """

    def __init__(self, package: str) -> None:
        self._package = package
        self._shared = frozenset(sys.modules)
        self._variant: str | None = None
        self._aside: dict[str, Modules] = {}

    def switch(self, variant: str) -> None:
        """Puts the modules of a variant in place of those of the one before."""
        if self._variant not in (None, variant):
            own = self._own()
            self._aside[str(self._variant)] = own
            self._remove(own)
            self._insert(self._aside.pop(variant, {}))
        self._variant = variant

    def _own(self) -> Modules:
        """The modules in place, without one that sets a variant while it is being imported."""
        return {
            name: module
            for name, module in sys.modules.items()
            if name.startswith(f"{self._package}.")
            and name not in self._shared
            and not getattr(module.__spec__, "_initializing", False)
        }

    def _remove(self, modules: Modules) -> None:
        package = sys.modules[self._package]
        for name, module in modules.items():
            del sys.modules[name]
            parent, _, child = name.rpartition(".")
            if parent == self._package and getattr(package, child, None) is module:
                delattr(package, child)

    def _insert(self, modules: Modules) -> None:
        sys.modules.update(modules)
        for name, module in modules.items():
            parent, _, child = name.rpartition(".")
            if parent == self._package:
                setattr(sys.modules[parent], child, module)
