"""Force fields over their curl: A, C and D
============================================

White is conservative: every closed path gives back what it took. Colour is curl, and a loop around
one colour feeds energy to the hand or drains it, each time it is turned.
"""  # noqa: D205, D415 - the first line is a reStructuredText title

import asperity as asp
from asperity.report import plot

texture = asp.Sinusoid(amplitude=0.2e-3, period=2e-3)
result = asp.compare(texture, laws="ACD", stiffness=1000.0, max_depth=0.5e-3)
figure = plot(result, picture="field")

# %%
# A has curl wherever the surface slopes: its worst loop gains this much per turn.

for row in result.rows:
    print(f"{row.law.letter}: {row.leak.energy * 1e6:6.1f} µJ ({row.leak.method})")

# %%
# C and D are gradients of an energy; their curl is zero by symbolic proof, not by sampling. But D
# is continuous only down to the medial axis below the crests.

for row in result.rows:
    print(f"{row.law.letter}: continuous: {row.continuous}; {row.continuous_reason}")
