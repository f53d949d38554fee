"""``asperity warm``: compile ahead what a first answer would wait for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import click

from asperity.cli.options import jobs_option
from asperity.cli.progress import step_bar

if TYPE_CHECKING:
    from asperity.laws import Law
    from asperity.textures import Texture


@click.command("warm")
@jobs_option
def command() -> None:
    """Compile the shipped laws on every kind of texture, and keep them in the cache.

    What is there already is not compiled again. A comparison of any surface then compiles nothing.
    """
    from asperity.laws import LAWS

    laws, kinds = tuple(LAWS.values()), small_textures()
    with step_bar("compiling", len(kinds) * len(laws)) as step:
        compile_ahead(laws, kinds, step)
    click.echo(f"Compiled: {len(laws)} laws on {', '.join(kinds)}")


def small_textures() -> dict[str, Texture]:
    """Return a small texture for each way in which heights are computed, by name."""
    from asperity.textures import Fourier, HeightMap, Profile, Sinusoid

    bumps = [0.0, 1.0e-5, 0.0, 2.0e-5]
    return {
        "sinusoids": Sinusoid(1.0e-5, 1.0e-3),
        "sums of waves": Fourier([1.0e-5, 1.0e-5], [[2.0e3, 0.0], [0.0, 3.0e3]]),
        "sums of parallel waves": Fourier([1.0e-5, 1.0e-5], [[2.0e3, 0.0], [3.0e3, 0.0]]),
        "profiles": Profile(bumps, 1.0e-3),
        "maps": HeightMap([bumps] * 4, 1.0e-3),
    }


def compile_ahead(
    laws: Sequence[Law], kinds: Mapping[str, Texture], step: Callable[[str], None]
) -> None:
    """Compare laws on textures, so that all that a comparison calls is compiled and kept.

    Args:
        laws: the laws.
        kinds: textures by name.
        step: is told what is compiled next.
    """
    from asperity.analysis.compare import compare
    from asperity.kept import anew

    for name, texture in kinds.items():

        def told(letter: str, name: str = name) -> None:
            step(f"law {letter} on {name}")

        with anew():
            compare(texture, laws=laws, progress=told)
