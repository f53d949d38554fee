"""Strength and support of all laws on one sinusoid
====================================================

Every law costs loop gain. *Strength* T is what it gives in texture for that gain, *support* S what
it gives in resistance to pressing. Up and to the right is better; the smooth wall has no texture
and full support.
"""  # noqa: D205, D415 - the first line is a reStructuredText title

import math

import matplotlib.pyplot as plt

import asperity as asp

texture = asp.Sinusoid(amplitude=0.2e-3, period=1e-3)
# A quarter of a period below the troughs.
depth = 2.0 * texture.amplitude + 0.25 * texture.period
result = asp.compare(texture, laws="WABCDEFG", max_depth=depth)

# %%
# Filled dots are conservative fields. A law whose gain is infinite (D, once the depth reaches the
# medial axis) has no strength and no support to state, and no dot.

below = {"F": (9, -12), "G": (-4, -17)}  # labels that would meet a neighbour

figure, axes = plt.subplots(figsize=(7.5, 5.0), layout="constrained")
for row in result.rows:
    letter, spot = row.law.letter, (row.strength, row.support)
    if math.isinf(row.q.value):
        print(f"{letter}: infinite gain")
        continue
    face = "#0072b2" if row.conservative else "white"
    axes.plot(*spot, "o", markersize=9, color="#0072b2", markerfacecolor=face)
    axes.annotate(letter, spot, below.get(letter, (8, 5)), textcoords="offset points")
    print(f"{letter}: T = {spot[0]:.3f}, S = {spot[1]:.2f}, q = {row.q.value:.2f}")
axes.set(xlabel="strength T", ylabel="support S", xlim=(-0.005, 0.12), ylim=(-0.05, 1.08))
axes.grid(color="#e4e7eb", linewidth=0.6)
