"""Friction beside a law: a stroke there and back
==================================================

Law H without friction, like ice, and with friction 0.4, along a stroke there and back at
constant height. Its own tangential force is the same both ways. Friction opposes the motion: the
anchor sticks at first, and the force rises with the presliding stiffness; then it slides.
"""  # noqa: D205, D415 - the first line is a reStructuredText title

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp

wave = asp.Sinusoid(amplitude=0.2e-3, period=2e-3)
half = np.linspace(0.0, 6e-3, 1201)
x = np.concatenate([half, half[::-1]])
path = np.column_stack([x, np.zeros_like(x), np.full_like(x, -0.4e-3)])

# %%
# The area between the two ways is the energy that friction takes. It is never negative.

figure, axes = plt.subplots(figsize=(8.0, 3.6), layout="constrained")
for friction, colour in ((0.0, "#5b6673"), (0.4, "#0072b2")):
    force = asp.Surface(wave, "H", stiffness=500.0, friction=friction).trace(path)[:, 0]
    axes.plot(1e3 * x, 1e3 * force, color=colour, label=f"friction {friction:g}")
    taken = -np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(x))
    print(f"friction {friction:g}: takes {1e6 * taken + 0.0:.0f} µJ there and back")
axes.set(xlabel="x [mm]", ylabel="tangential force [mN]")
axes.legend(frameon=False)
