"""The codeless USD schema PureLightLuminaireAPI: plain data, found by USD after `register`.

Applications that load plugins themselves set PXR_PLUGINPATH_NAME to `DIRECTORY`.
"""

from __future__ import annotations

from pathlib import Path

from purelight_format.errors import PureLightError

SCHEMA = "PureLightLuminaireAPI"
DIRECTORY = Path(__file__).parent


def register() -> None:
    """Makes the schema known; call it before the first stage is opened in the process.

    Later it does no harm but has no effect, as OpenUSD builds its registry of schemas once.

    Raises:
        PureLightError: If OpenUSD is not installed.
    """
    try:
        from pxr import Plug
    except ImportError as error:
        remedy = "pip install 'purelight[usd]'"
        raise PureLightError(f"USD scenes need the usd-core package: {remedy}") from error
    Plug.Registry().RegisterPlugins(DIRECTORY.as_posix())
