"""Texts that are filled in for a lamp, and pages that are the same for every one."""

from importlib.resources import files


def page(name: str) -> str:
    """The text of a file in this folder."""
    return files(__name__).joinpath(name).read_text("utf-8")
