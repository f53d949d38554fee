"""Where the god-object jumps
==============================

Law D pulls the probe to the nearest point of the surface. Below a crest, from its radius of
curvature down, two points are equally near, one on each flank: crossing that line (the medial
axis) the god-object changes sides and the tangential force jumps.
"""  # noqa: D205, D415 - the first line is a reStructuredText title

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp

texture = asp.Sinusoid(amplitude=0.2e-3, period=1e-3)
crest = texture.period / 4.0
radius = 1.0 / texture.bounds[1]  # of curvature, at the crest
print(f"radius of curvature at the crest: {radius * 1e6:.1f} µm")

surface = asp.Surface(texture, "D", stiffness=1000.0, max_depth=1.5 * radius)
onset = asp.characteristic_number(surface).at
if onset is not None:
    print(f"medial axis from x = {onset[0] * 1e3:.2f} mm, z = {onset[2] * 1e3:.4f} mm down")

# %%
# Left: the springs of the god-object at one depth. Right: the tangential force across the crest,
# above the onset (continuous, ever steeper) and below it (a jump).

figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.2), layout="constrained")
x = np.linspace(-0.4e-3, 0.4e-3, 2001)
heights = texture.height(np.column_stack([crest + x, 0.0 * x]))
left.plot(x * 1e3, heights * 1e3, color="#1d2733")
probes = np.zeros((24, 3))
probes[:, 0] = crest + np.linspace(-0.18e-3, 0.18e-3, 24)
probes[:, 2] = texture.amplitude - 3.0 * radius
for probe, foot in zip(probes, texture.nearest(probes), strict=True):
    ends = np.array([probe, foot]) * 1e3
    left.plot(ends[:, 0] - crest * 1e3, ends[:, 2], color="#009e73", linewidth=0.9)
left.plot((probes[:, 0] - crest) * 1e3, probes[:, 2] * 1e3, ".", color="#d55e00")
left.plot([0.0], [(texture.amplitude - radius) * 1e3], "k+", markersize=10)
left.set(xlabel="x from the crest [mm]", ylabel="z [mm]", aspect="equal")

for part, colour in ((0.5, "#9ecae1"), (0.9, "#4292c6"), (1.5, "#08519c"), (3.0, "#d55e00")):
    z = texture.amplitude - part * radius
    path = np.column_stack([crest + x, np.zeros_like(x), np.full_like(x, z)])
    force = surface.force(path)[:, 0]
    if part > 1.0:
        force[np.argmin(np.abs(x))] = np.nan  # below the onset: do not join the jump
    right.plot(x * 1e3, force, color=colour, label=f"{part:g} radii below the crest")
right.set(xlabel="x from the crest [mm]", ylabel="tangential force [N]", xlim=(-0.15, 0.15))
right.legend(frameon=False, fontsize=8)
