"""The facts in the generated files agree with those derived from the symbolic laws."""

from __future__ import annotations

import subprocess
import sys

import pytest
import sympy as sp

from asperity.derive.facts import clamped_facts, derive_facts, law_facts
from asperity.laws import LAWS, Law
from asperity.laws.clamps import LATERAL

CONSERVATIVE = "WCD"
# Laws whose force depends on slope or height at the contact, not only on the depth.
DEPENDS_ON_SURFACE = "BCDFG"


@pytest.mark.parametrize("letter", "WABCDEFG")
def test_facts_of_shipped_laws(letter: str):
    facts = law_facts(LAWS[letter])
    assert facts.conservative == (letter in CONSERVATIVE)
    assert facts.vanishes_at_contact
    assert facts.depends_on_surface == (letter in DEPENDS_ON_SURFACE)
    assert facts.affine_in_depth == (letter != "D")
    assert (facts.curl == ("0", "0", "0")) == (letter in CONSERVATIVE)


@pytest.mark.parametrize("letter", "WABCEFG")
def test_generated_facts_equal_derived_facts(letter: str):
    assert law_facts(LAWS[letter]) == derive_facts(LAWS[letter])


def test_facts_of_user_defined_laws_are_derived():
    square = Law("A", "square", "vertical", lambda c: c.k * c.depth**3 * c.w)
    facts = law_facts(square)
    assert facts.conservative
    assert not facts.affine_in_depth
    assert facts.depends_on_surface
    jumping = Law("J", "jump", "nominal", lambda c: c.k * (c.depth + 1) * c.position[0] * c.e_z)
    facts = law_facts(jumping)
    assert not facts.vanishes_at_contact
    assert not facts.affine_in_depth  # the position varies with the depth


def test_piecewise_law_is_not_affine_in_the_depth():
    """Each piece may be affine, but the greatest Jacobian may be where they meet."""
    law = Law(
        "P",
        "pieces",
        "vertical",
        lambda c: c.k * sp.Piecewise((c.depth**2, c.depth < 1e-4), (0, True)) * c.e_z,
    )
    assert not law_facts(law).affine_in_depth


def test_conservative_clamps_of_each_law():
    clamps = {letter: law_facts(LAWS[letter]).conservative_clamps for letter in LAWS}
    assert clamps.pop("C") == ("whole", "backed")
    assert set(clamps.values()) == {()}
    assert clamped_facts(LAWS["C"], LATERAL).reason.startswith("below max_depth the lateral")
    # A law without clamp keeps its facts.
    assert clamped_facts(LAWS["H"], LATERAL) is law_facts(LAWS["H"])


def test_shipped_facts_do_not_import_sympy():
    code = (
        "import sys; from asperity.derive.facts import law_facts; from asperity.laws import LAWS;"
        "facts = [law_facts(law) for law in LAWS.values()]; sys.exit('sympy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
