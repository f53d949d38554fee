"""Settings of the documentation: nothing is loaded from the network, while building or reading."""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
ROOT = HERE.parent
sys.path.insert(0, str(HERE / "_ext"))
os.environ.setdefault("MPLBACKEND", "agg")

import asperity  # noqa: E402 - after the path of the extensions is set

project = "asperity"
author = "The asperity developers"
copyright = author  # noqa: A001 - the name that Sphinx reads
release = version = asperity.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
    "mathsvg",
    "device_page",
    "docstrings",
    "live_force",
    "runblock",
]
exclude_patterns = [
    "_build", "_ext", "_generated", "README.md", "gallery/sg_execution_times.rst", "devices/_*.md",
]  # fmt: skip
suppress_warnings = ["config.cache"]

# The formulas are drawn when the pages are built.
html_math_renderer = "mathsvg"
math_number_all = False
math_eqref_format = "({number})"
numfig = True
myst_enable_extensions = ["dollarmath", "deflist", "colon_fence", "attrs_inline"]
myst_heading_anchors = 3
myst_dmath_double_inline = True

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": True}
autodoc_type_aliases = {"ArrayLike": "ArrayLike", "FloatArray": "FloatArray"}
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_custom_sections = ["Reference"]

html_theme = "furo"
html_title = "asperity"
html_static_path = ["_static"]
html_css_files = ["asperity.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {
    "light_css_variables": {
        "color-brand-primary": "#1b5e7a",
        "color-brand-content": "#1b5e7a",
        "color-brand-visited": "#5b4a8a",
    },
    "dark_css_variables": {
        "color-brand-primary": "#7cc4e0",
        "color-brand-content": "#7cc4e0",
        "color-brand-visited": "#b7a6e6",
    },
}
pygments_style = "friendly"
pygments_dark_style = "github-dark"


def source_digest() -> str:
    """Return a digest of the package: what the pages print depends on it."""
    digest = hashlib.sha256()
    folders = (ROOT / "src", HERE / "_ext")
    for folder in folders:
        for path in sorted(folder.rglob("*")):
            if path.suffix in {".py", ".toml"}:
                digest.update(path.read_bytes())
    return digest.hexdigest()


# Pages and gallery are run again when the code has changed, and only then.
code_digest = source_digest()
_digest_file = HERE / "_generated" / "code-digest"
_is_code_changed = not _digest_file.exists() or _digest_file.read_text("utf-8") != code_digest
_digest_file.parent.mkdir(exist_ok=True)

sphinx_gallery_conf: dict[str, Any] = {
    "examples_dirs": ["../examples/gallery"],
    "gallery_dirs": ["gallery"],
    "filename_pattern": r"\.py$",
    "run_stale_examples": _is_code_changed,
    "image_scrapers": ("gallery_figures",),
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_signature": False,
    "write_computation_times": False,
    "min_reported_time": 1e6,
    "plot_gallery": True,
    "thumbnail_size": (480, 300),
    "reset_modules": (),
    "capture_repr": (),
    "show_api_usage": False,
    "remove_config_comments": True,
}


def _write_digest(app: Any, exception: Exception | None) -> None:
    if exception is None and app.builder.format == "html":
        _digest_file.write_text(code_digest, encoding="utf-8")


def setup(app: Any) -> None:
    """Make the pages depend on the code of the package."""
    app.add_config_value("code_digest", "", "env", types=(str,))
    app.connect("build-finished", _write_digest)
