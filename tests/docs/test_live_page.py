"""The live force of the page "In a browser": that of the native library, in a real browser."""

from __future__ import annotations

import html
import importlib.util
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from bench.speed.c_programs import surface_ticks

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
BROWSER = next((found for found in map(shutil.which, NAMES) if found), None)
SCRIPT = """
<script type="module">
const points = POINTS;
while (!globalThis.liveForce) {
  await new Promise((resolve) => setTimeout(resolve, 20));
}
const forces = points.map((point) => [...liveForce.force(point)]);
liveForce.reset();
const canvas = document.querySelector("#live-force canvas");
const frame = canvas.getBoundingClientRect();
for (let step = 0; step < 40; step++) {
  canvas.dispatchEvent(new PointerEvent("pointermove", {
    clientX: frame.left + (0.3 + 0.01 * step) * frame.width,
    clientY: frame.top + 0.5 * frame.height }));
}
const inked = [...document.querySelectorAll("#live-force canvas")].map((one) => {
  const pixels = one.getContext("2d").getImageData(0, 0, one.width, one.height).data;
  return pixels.filter((value, i) => i % 4 == 3 && value).length;
});
const said = document.querySelector("#live-force output").textContent;
document.body.append(Object.assign(document.createElement("pre"),
  { id: "result", textContent: JSON.stringify({ forces, inked, said, facts: liveForce.facts }) }));
</script>
"""


@pytest.fixture(scope="module")
def live_force() -> ModuleType:
    """Return the extension of the documentation; skip the test where it shows nothing."""
    pytest.importorskip("sphinx", reason="not run: the tools of the documentation are missing")
    path = Path(__file__).parents[2] / "docs" / "_ext" / "live_force.py"
    spec = importlib.util.spec_from_file_location("live_force", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    if module.missing_tool() is not None:
        pytest.skip(f"not run: no {module.missing_tool()} here")
    return module


@pytest.fixture(scope="module")
def points() -> Any:
    return np.random.default_rng(8).uniform(-3e-4, 3e-4, (400, 3))


@pytest.fixture(scope="module")
def shown(live_force: ModuleType, points: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return what a browser shows after the pointer has stroked the drawing."""
    if BROWSER is None:
        pytest.skip("not run: no browser (chromium) here")
    folder = tmp_path_factory.mktemp("page")
    page = folder / "page.html"
    script = SCRIPT.replace("POINTS", json.dumps(points.tolist()))
    page.write_text(f"<html><body>{live_force.build_html()}{script}</body></html>", "utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"]
    profile = f"--user-data-dir={folder / 'browser'}"
    command = [BROWSER, *options, profile, "--virtual-time-budget=4000", page.as_uri()]
    dom = subprocess.run(command, capture_output=True, check=True, timeout=120).stdout.decode()
    match = re.search(r'<pre id="result">(.*?)</pre>', dom, re.DOTALL)
    assert match is not None, "the script stopped"
    return json.loads(html.unescape(match[1]))


def test_forces_are_those_of_the_native_kernel(
    shown: Any, live_force: ModuleType, points: Any
) -> None:
    expected = surface_ticks(live_force.surface(), points).result()[:, :3]
    assert np.count_nonzero(expected[:, 2]) > 100
    # The browser has a sine of its own.
    np.testing.assert_allclose(shown["forces"], expected, rtol=0, atol=1e-15)
    assert shown["facts"]["stiffness"] == live_force.STIFFNESS
    assert np.abs(np.array(shown["forces"]) - 1.000001 * expected).max() > 1e-8


def test_stroke_is_drawn_with_its_force(shown: Any) -> None:
    surface, strip = shown["inked"]
    assert surface > 50_000  # the body fills half of the drawing
    assert strip > 1000
    assert re.fullmatch(r"f = \(-?\d\.\d{3}, \d\.\d{3}\) N at z = -0\.\d{3} mm", shown["said"])


def test_page_loads_nothing(live_force: ModuleType) -> None:
    text = live_force.build_html()
    assert not re.search(r"https?://|\bfetch\(|\bimport\s+[^(]|src=", text)
