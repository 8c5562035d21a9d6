"""Sphinx configuration of the site; build it with ``make docs``."""

from __future__ import annotations

import os
import re
import shutil
import sys
from pathlib import Path
from typing import Any

from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import mathml  # noqa: E402
import notebooks  # noqa: E402
import pictures  # noqa: E402

import gms_fsm  # noqa: E402
from plots.style import CHART_THEMES  # noqa: E402

project = "gms-fsm"
author = "The gms-fsm founders"
project_copyright = "The gms-fsm founders, MIT licence"
version = release = gms_fsm.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
]
# With `-t draft`, as the tests build it, the site has no pages of sources, one lesson that is run,
# few positions of its sliders, a search that knows the first page only, no names of the API in the
# contents beside a page, and no dark pictures of the zoo.
toc_object_entries = not tags.has("draft")  # noqa: F821  # defined by Sphinx
if toc_object_entries:
    extensions.append("sphinx.ext.viewcode")
exclude_patterns = ["**/__pycache__"]
smartquotes_action = "D"  # "dp45" can be copied literally
default_role = "py:obj"  # a name in backticks in a docstring is a link if the name exists

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings give type, shape and unit
napoleon_google_docstring = False
napoleon_use_param = False  # types are words here ("shape (n,), m"), not names to link
napoleon_use_rtype = False
napoleon_custom_sections = [("Attributes", "params_style")]
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

# The site loads nothing from other hosts: system fonts, formulas as MathML.
html_theme = "furo"
html_title = "gms-fsm"
html_favicon = "favicon.svg"
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False
html_static_path = ["site.css", "site.js"]
html_css_files = ["site.css"]
html_js_files = [("site.js", {"defer": "defer"})]
html_theme_options = {
    "light_css_variables": {
        "color-brand-primary": "#005F96",
        "color-brand-content": "#005F96",
        "color-brand-visited": "#7A3E8E",
        "color-now": CHART_THEMES["light"].fired,
    },
    "dark_css_variables": {
        "color-brand-primary": "#6CB9EA",
        "color-brand-content": "#6CB9EA",
        "color-brand-visited": "#C9A0DC",
        "color-now": CHART_THEMES["dark"].fired,
    },
}


def keep_bars(*arguments: Any) -> None:
    """Escape |z| in docstrings (not a substitution) and a line "s." (not a list item)."""
    lines: list[str] = arguments[-1]
    for number, line in enumerate(lines):
        if not line.lstrip().startswith((">>>", "...")):
            parts = re.split(r"(``.*?``)", line)
            parts[::2] = [part.replace("|", r"\|") for part in parts[::2]]
            lines[number] = re.sub(r"^(\s*)([A-Za-z]\.)(?=\s|$)", r"\1\\\2", "".join(parts))


def mend_ways_back(app: Sphinx, page: str, _: str, context: dict[str, Any], __: Any) -> None:
    """Fix links from a source page to objects that are documented under a shorter name.

    Sphinx uses one module name for all objects of a source file, but
    ``gms_fsm.traces.trace.Trace`` is documented as ``gms_fsm.Trace`` and
    ``gms_fsm.traces.trace.dwell_times`` is not.
    """
    if not page.startswith("_modules/") or "body" not in context:
        return
    objects = app.env.get_domain("py").objects  # type: ignore[attr-defined]

    def mended(match: re.Match[str]) -> str:
        there = os.path.normpath(Path(page).parent / match["page"])
        parts = match["name"].split(".")
        for first in range(len(parts)):
            ending = "." + ".".join(parts[first:])
            for name, found in objects.items():
                if found.docname == there and f".{name}".endswith(ending):
                    return f'{match["before"]}{match["page"]}.html#{name}"'
        return match[0]

    context["body"] = re.sub(
        r'(?P<before>class="viewcode-back" href=")(?P<page>[^"#]*)\.html#(?P<name>[^"]*)"',
        mended,
        context["body"],
    )


def open_to_all(_: Sphinx, __: str, ___: str, context: dict[str, Any], ____: Any) -> None:
    """Make scrolling parts reachable by keyboard, and give the contents their level."""
    if "body" in context:
        wide = r'<(pre(?=>)|div(?= class="(?:math|table-wrapper)\b))'
        context["body"] = re.sub(wide, r'<\1 tabindex="0"', context["body"])
    tree = context.get("furo_navigation_tree", "")
    context["furo_navigation_tree"] = tree.replace(
        'role="heading"', 'role="heading" aria-level="2"'
    )


def make_lessons(app: Sphinx) -> None:
    """Write the lessons' pages next to their index; a draft runs the first lesson only."""
    notebooks.write_all(HERE / "lessons", *([[1]] if app.tags.has("draft") else []))


def leave_out_index(app: Sphinx) -> None:
    """Let the search of a draft know the first page only."""
    if app.tags.has("draft"):
        builder: Any = app.builder
        feed = builder.index_page
        builder.index_page = lambda name, *rest: feed(name, *rest) if name == "index" else None


def copy_replay_pages(app: Sphinx, error: Exception | None) -> None:
    """Copy the lessons' replay pages next to their pages."""
    if error is None:
        for path in (HERE / "lessons").glob("*_replay.html"):
            shutil.copy(path, Path(app.outdir) / "lessons")


def setup(app: Sphinx) -> None:
    """Register our handlers."""
    mathml.register(app)
    pictures.register(app)
    app.add_lexer("csv", TextLexer)
    app.connect("autodoc-process-docstring", keep_bars, priority=100)  # before napoleon
    app.connect("html-page-context", mend_ways_back)
    app.connect("html-page-context", open_to_all, priority=900)  # after the theme
    app.connect("builder-inited", make_lessons)
    app.connect("builder-inited", leave_out_index)
    app.connect("build-finished", copy_replay_pages)
