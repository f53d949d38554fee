"""A measured surface, prepared step by step
=============================================

Instruments deliver tilt, noise and holes. This map is made in code with all three, saved as an
NPY file and read like any measured one; the result says what was done to it.
"""  # noqa: D205, D415 - the first line is a reStructuredText title

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp

rng = np.random.default_rng(7)
pitch = 5e-6
side = 160
x, y = np.meshgrid(np.arange(side) * pitch, np.arange(side) * pitch)
raw = 4e-6 * np.sin(2.0 * np.pi * x / 160e-6 + 1.5 * np.sin(2.0 * np.pi * y / 500e-6))
raw += 0.03 * x - 0.012 * y  # the sample was mounted askew
raw += 0.25e-6 * rng.standard_normal(raw.shape)  # the sensor's noise
raw[(x - 5.5e-4) ** 2 + (y - 2.5e-4) ** 2 < (4e-5) ** 2] = np.nan  # a spot without reflection

# %%
# A NPY file holds bare numbers, so the pitch is an argument. Lengths are the surface's own metres;
# the magnification comes last.

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "sample.npy"
    np.save(path, raw)
    texture = asp.load_texture(path, pitch=pitch, s_cutoff=30e-6, magnify=10)
for sentence in texture.preparation:
    print("-", sentence)

# %%
# The same surface before and after. Note that the plane is gone, the hole is closed, and the
# noise is below the cut-off.

figure, panels = plt.subplots(1, 2, figsize=(10.0, 4.3), layout="constrained")
extent = side * pitch
before = panels[0].imshow(
    raw * 1e6, origin="lower", extent=(0.0, extent * 1e3, 0.0, extent * 1e3), cmap="cividis"
)
panels[0].set_title("as measured", loc="left")
figure.colorbar(before, ax=panels[0], label="height [µm]", shrink=0.8)

ticks = np.linspace(0.0, (side - 1) * pitch * 10, 320)
grid = np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2)
heights = texture.height(grid).reshape(320, 320)
wide = float(ticks[-1]) * 1e3
after = panels[1].imshow(
    heights * 1e6, origin="lower", extent=(0.0, wide, 0.0, wide), cmap="cividis"
)
panels[1].set_title("as rendered, 10 times larger", loc="left")
figure.colorbar(after, ax=panels[1], label="height [µm]", shrink=0.8)
for axes in panels:
    axes.set(xlabel="x [mm]", ylabel="y [mm]")
