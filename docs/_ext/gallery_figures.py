"""Pictures of the gallery: every Matplotlib figure that a script holds, saved once.

``asperity.report.plot`` makes figures without pyplot, so they are looked for among the variables.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from weakref import WeakSet

_SAVED: WeakSet[Any] = WeakSet()
_DPI = 130


def scraper(_block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Save the new figures of a block and return the reStructuredText that shows them."""
    from matplotlib.figure import Figure
    from sphinx_gallery.scrapers import figure_rst

    paths = []
    for value in list(block_vars["example_globals"].values()):
        if isinstance(value, Figure) and value not in _SAVED:
            _SAVED.add(value)
            path = Path(next(block_vars["image_path_iterator"]))
            value.savefig(path, dpi=_DPI)
            paths.append(str(path))
    return str(figure_rst(paths, gallery_conf["src_dir"])) if paths else ""


def _get_sg_image_scraper() -> Any:
    return scraper
