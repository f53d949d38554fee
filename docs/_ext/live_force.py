"""``{live-force}``: an exported force in the page, as WebAssembly that is built with the pages.

Where no compiler for WebAssembly is installed, the page says so.
"""

from __future__ import annotations

import base64
import shutil
import subprocess
import tempfile
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import asperity as asp

ROOT = Path(__file__).parents[2]
AMPLITUDE, PERIOD, STIFFNESS = 0.1e-3, 1e-3, 800.0
FLAGS = (
    *("--target=wasm32", "-std=c99", "-O2", "-ffreestanding", "-nostdlib", "-mbulk-memory"),
    *("-fvisibility=hidden", "-DTEXTURE_BUILD", "-DTEXTURE_NO_LIBC", "-Wl,--no-entry"),
    *("-Wl,--export-dynamic", "-Wl,--export=__heap_base", "-Wl,--allow-undefined"),
)


def missing_tool() -> str | None:
    """Return a program that is needed and not installed; ``None`` if all are."""
    return next((name for name in ("clang", "wasm-ld") if shutil.which(name) is None), None)


def surface() -> asp.Surface:
    """Return the surface of the page."""
    wave = asp.Sinusoid(amplitude=AMPLITUDE, period=PERIOD)
    return asp.Surface(wave, "C", STIFFNESS, max_depth=0.3e-3, clamp="backed")


def build_wasm(folder: Path) -> bytes:
    """Export the surface into a folder and return its library for WebAssembly."""
    asp.export_code(surface(), folder / "texture.h", shared=True)
    command = ["clang", *FLAGS, "texture.c", "-o", "texture.wasm"]
    subprocess.run(command, cwd=folder, check=True)
    return (folder / "texture.wasm").read_bytes()


def build_html() -> str:
    """Return the part of the page with the force, which loads nothing."""
    with tempfile.TemporaryDirectory() as directory:
        wasm = base64.b64encode(build_wasm(Path(directory))).decode()
    html = (ROOT / "docs" / "_ext" / "live_force.html").read_text("utf-8")
    caller = (ROOT / "examples" / "export" / "caller.mjs").read_text("utf-8")
    return html.replace("// CALLER", caller).replace("WASM", wasm, 1)


class LiveForce(SphinxDirective):
    """A drawing that is pressed and stroked with the pointer."""

    def run(self) -> list[nodes.Node]:
        """Return the drawing, or a sentence."""
        self.env.note_dependency(str(ROOT / "docs" / "_ext" / "live_force.html"))
        missing = missing_tool()
        if missing is not None:
            text = f"Not shown: these pages were built on a machine without {missing}."
            return [nodes.paragraph("", text)]
        return [nodes.raw("", build_html(), format="html")]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("live-force", LiveForce)
    return {"parallel_read_safe": True}
