"""What every law does along a straight scan
=============================================

A probe slides at constant height over two periods of a sinusoid, pressed so deep that it stays
below the troughs. Each law turns the same heights into another force: tangential (along the scan)
and normal (out of the body).
"""  # noqa: D205, D415 - the first line is a reStructuredText title

import matplotlib.pyplot as plt
import numpy as np

import asperity as asp
from asperity.laws import find_laws

texture = asp.Sinusoid(amplitude=0.1e-3, period=2e-3)
depth = 0.4e-3
x = np.linspace(0.0, 2.0 * texture.period, 801)

# %%
# Laws with the nominal contact (W, F, G) measure depth from the smooth wall z = 0, the others from
# the texture itself. The scan runs at the same distance below the highest point that each law can
# feel, so that all of them stay in contact.

figure, panels = plt.subplots(4, 2, figsize=(10.0, 8.0), sharex=True, sharey=True)
figure.set_layout_engine("constrained")
for axes, law in zip(panels.ravel(), find_laws("WABCDEFG"), strict=True):
    surface = asp.Surface(texture, law, stiffness=1000.0, max_depth=depth)
    top = 0.0 if law.contact.name == "nominal" else texture.extremes[1]
    path = np.column_stack([x, np.zeros_like(x), np.full_like(x, top - depth)])
    force = surface.trace(path)  # carries the state of law F from point to point
    axes.plot(x * 1e3, force[:, 2], color="#d55e00", label="normal")
    axes.plot(x * 1e3, force[:, 0], color="#0072b2", label="tangential")
    axes.axhline(0.0, color="#c9ced6", linewidth=0.8)
    axes.set_title(f"{law.letter}  {law.name.replace('-', ' ')}", loc="left", fontsize=10)
for axes in panels[-1]:
    axes.set_xlabel("x [mm]")
for axes in panels[:, 0]:
    axes.set_ylabel("force [N]")
handles, names = panels[0, 0].get_legend_handles_labels()
figure.legend(handles, names, loc="outside upper right", ncols=2, frameon=False)

# %%
# W is the smooth wall: no texture. A and E push along the wall's normal only, so the hand feels
# bumps but no sideways force. F is friction: until its anchor is dragged at full deflection it
# winds up like a spring.
