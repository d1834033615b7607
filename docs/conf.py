"""How the documentation is built: `make docs`, offline, into out/docs."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math import latex2mathml

from purelight_mitsuba import use

ROOT = Path(__file__).parents[1]
use()  # Mitsuba's modules can only be read once a variant is set.

project = "PureLight"
author = "the PureLight developers"
html_title = "PureLight"
extensions = [
    "myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode",
    "sphinx.ext.doctest",
]  # fmt: skip
html_theme = "furo"
html_static_path = ["figures"]
html_css_files = ["site.css"]
html_show_copyright = False

default_role = "code"  # Docstrings quote code like Markdown does.
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_class_signature = "separated"
napoleon_google_docstring = True
napoleon_numpy_docstring = False

myst_enable_extensions = ["dollarmath", "deflist", "attrs_inline"]
myst_heading_anchors = 3
suppress_warnings = ["myst.header"]  # The spec's pages are also read without this site.

TYPE = ":type: "
SPEC = (
    "measures", "plux", "finishes", "onnx_profile", "usd", "conformance", "EXAMPLE", "ATTACKS",
    "ISSUES", "SECURITY",
)  # fmt: skip

# Notebooks show what the lamp of `make demo` gives, if it has been made.
LAMP = ROOT / "out" / "demo" / "lamp.plux"
nb_execution_mode = "cache" if LAMP.is_file() else "off"
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_output_stderr = "remove"  # Progress, of which every step would be a block.
os.environ.setdefault("PURELIGHT_LAMP", str(LAMP))


def gather_spec() -> None:
    """Copies the spec's pages to `docs/spec/`, with anchors and links in the words of this site."""
    folder = Path(__file__).parent / "spec"
    shutil.copytree(ROOT / "spec", folder, dirs_exist_ok=True)
    shutil.copy(ROOT / "SECURITY.md", folder)
    for page in folder.glob("*.md"):
        text = re.sub(r'<a id="(\w+)"></a>', r"(\1)=\n", page.read_text("utf-8"))
        text = text.replace("](../SECURITY.md)", "](SECURITY.md)").replace(
            "[schema/](schema)", "`schema/`"
        )
        page.write_text(re.sub(r"\]\(spec/", "](", text), "utf-8")
    tree = "\n".join(["", "```{toctree}", ":hidden:", "", *SPEC, "```", ""])
    with (folder / "README.md").open("a", encoding="utf-8") as file:
        file.write(tree)


def mathml(self: Any, node: nodes.Element) -> None:
    """Formulas as MathML, which browsers draw themselves: no script, no network."""
    block = isinstance(node, nodes.math_block)
    self.body.append(latex2mathml.tex2mathml(node.astext(), as_block=block))
    raise nodes.SkipNode


def whole(_app: Any, what: str, _name: str, _of: Any, _options: Any, lines: list[str]) -> None:
    """Docstrings of properties as they are: napoleon took what is before a colon for a type."""
    for line in lines:
        if what == "property" and line.startswith(TYPE):
            lines[:] = [f"{line[len(TYPE) :]}: {lines[0]}", ""]


def setup(app: Any) -> None:
    """Gathers the spec and registers the writer of formulas."""
    gather_spec()
    app.connect("autodoc-process-docstring", whole, priority=600)  # After napoleon's 500.
    app.add_html_math_renderer("mathml", (mathml, None), (mathml, None))


html_math_renderer = "mathml"
