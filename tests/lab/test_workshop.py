"""The process beside the loop: it knows the user's own laws too."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from asperity.cli.own_code import learn
from asperity.lab import workshop
from asperity.lab.workshop import Sent
from asperity.textures import Sinusoid

OWN = str(Path(__file__).parents[2] / "examples" / "own_law.py")


def test_a_law_of_the_users_own_is_shown() -> None:
    numbers = {"stiffness": 100.0, "max_depth": 3e-4, "clamp": "none", "law_parameters": {}}
    sent = Sent(Sinusoid(0.1e-3, 2e-3), "S", numbers)
    with workshop.workshop(partial(learn, (OWN,))) as other:
        other.submit(workshop.show, sent).result()
        relief = np.frombuffer(other.submit(workshop.picture, "relief", (0.0, 0.0, 8e-3)).result())
    assert relief[0] == 2.0
    assert np.abs(relief[5:]).max() > 0.9e-4
