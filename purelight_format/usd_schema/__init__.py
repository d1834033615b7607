"""The codeless USD schema PureLightLuminaireAPI: plain data, found by USD after `register`.

Applications that load plugins themselves set PXR_PLUGINPATH_NAME to `DIRECTORY`.
"""

from __future__ import annotations

from pathlib import Path

SCHEMA = "PureLightLuminaireAPI"
DIRECTORY = Path(__file__).parent


def register() -> None:
    """Makes the schema known; call it before the first stage is opened in the process.

    Later it does no harm but has no effect, as OpenUSD builds its registry of schemas once.
    """
    from pxr import Plug

    Plug.Registry().RegisterPlugins(DIRECTORY.as_posix())
