"""The characteristic number against depth: closed form and samples
====================================================================

q says by how much a law multiplies the stiffness of the smooth wall at worst. For a sinusoid it is
known in closed form; the dots are an independent search over the compiled Jacobians.
"""  # noqa: D205, D415 - the first line is a reStructuredText title

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp
from asperity.analysis.gain.proofs import q_b, q_c, q_g

texture = asp.Sinusoid(amplitude=0.1e-3, period=1e-3)
depths = np.linspace(0.0, 0.8e-3, 200)[1:]
sampled = depths[9::24]
x = np.linspace(0.0, texture.period, 721)


def greatest_norm(law: str, depth: float) -> float:
    """Return the greatest ‖J‖/k over one period and 15 depths."""
    surface = asp.Surface(texture, law, stiffness=1.0, max_depth=depth)
    flat = np.zeros_like(x)
    top = flat if law == "G" else texture.height(np.column_stack([x, flat]))
    best = 0.0
    for part in np.linspace(1e-9, 1.0, 15):
        probes = np.column_stack([x, flat, top - part * depth])
        norms = np.linalg.norm(surface.jacobian(probes), 2, axis=(1, 2))
        best = max(best, float(norms.max()))
    return best


# %%
# B and G leave their flat part where curvature times depth overtakes the slope; C, whose force has
# no normalised direction, is steeper from the start.

figure, axes = plt.subplots(figsize=(9.0, 4.6), layout="constrained")
worst = 0.0
for law, q, colour in (("B", q_b, "#0072b2"), ("C", q_c, "#d55e00"), ("G", q_g, "#009e73")):
    closed = np.array([q(texture, depth) for depth in depths])
    dots = np.array([greatest_norm(law, depth) for depth in sampled])
    exact = np.array([q(texture, depth) for depth in sampled])
    worst = max(worst, float(np.abs(dots / exact - 1.0).max()))
    axes.plot(depths * 1e3, closed, color=colour, label=f"law {law}, closed form")
    axes.plot(sampled * 1e3, dots, "o", color=colour, label=f"law {law}, samples")
axes.set_xlabel("greatest depth D [mm]")
axes.set_ylabel("characteristic number q")
axes.legend(ncols=3, frameon=False)
print(f"largest difference between closed form and samples: {worst:.1e}")
