"""The commands ``init``, ``cache`` and ``warm``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from asperity.cli import output
from asperity.cli.main import declare_command
from asperity.cli.options import jobs_option
from asperity.core import cache
from asperity.core.errors import AsperityError, escape_unprintable

if TYPE_CHECKING:
    from asperity.laws import Law
    from asperity.textures import Texture


@declare_command("init")
@click.argument("scene")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def init_command(scene: str, *, force: bool) -> None:
    """Write a template scene to SCENE (TOML).

    It can be simulated as it is; all other settings are comments.
    """
    from asperity.scene.scene_template import scene_template

    text = scene_template(Path(scene).name)
    output.write_template("scene", scene, text, "asperity simulate {}", force=force)


_NAMESPACE_LABELS = {
    cache.RESULTS_NAMESPACE: "results of surfaces",
    "code": "compiled laws, textures and loops",
}


@declare_command("cache")
@click.option("--clear", is_flag=True, help="Delete all entries.")
@output.output_options(html=False, uses_cache=False)
def cache_command(outputs: output.Outputs, *, clear: bool) -> None:
    """Show the directory, size and limit of the cache, or clear it.

    If the cache exceeds its limit, the least recently used entries are deleted first.
    ASPERITY_CACHE_DIR sets another directory, ASPERITY_CACHE_SIZE another limit, such as 500MB.
    Commands that compute accept --no-cache.
    """
    before = cache.list_entries()
    entries = cache.clear() if clear else before
    folder = cache.cache_folder()
    limit = cache.size_limit()
    names = sorted({*_NAMESPACE_LABELS, *(entry.namespace for entry in entries)})
    sizes = {name: [one.size for one in entries if one.namespace == name] for name in names}
    total = _format_megabytes(entry.size for entry in entries)
    lines = [f"{escape_unprintable(str(folder))}: {total} of at most {_format_megabytes([limit])}"]
    for name, parts in sizes.items():
        label = _NAMESPACE_LABELS.get(name, "of another version, not used by this one")
        lines.append(f"  {name:<13} {len(parts):>6} {_format_megabytes(parts):>10}  {label}")
    if clear:
        lines.append(f"Deleted: {len(before) - len(entries)} entries")
    rooms = [
        {"name": name, "entries": len(parts), "size": sum(parts)} for name, parts in sizes.items()
    ]
    data = {"schema": 1, "folder": str(folder), "limit": limit, "rooms": rooms}
    from asperity.report.page import Paragraph, terminal_page

    outputs.write(data, terminal_page(Paragraph("\n".join(lines), "code")))
    if clear and entries:
        raise AsperityError(f"{len(entries)} entries of {folder} cannot be deleted")


def _format_megabytes(sizes: Iterable[int]) -> str:
    return f"{sum(sizes) / 1e6:.1f} MB"


@declare_command("warm")
@jobs_option
def warm_command() -> None:
    """Compile the shipped laws for every texture kind and store the code in the cache.

    Functions that are in the cache are not compiled again. Afterwards, comparisons of shipped
    laws compile nothing.
    """
    from asperity.laws import LAWS

    laws = tuple(LAWS.values())
    textures = sample_textures()
    with output.step_bar("compiling", len(textures) * len(laws)) as step:
        precompile(laws, textures, step)
    click.echo(f"Compiled: {len(laws)} laws on {', '.join(textures)}")


def sample_textures() -> dict[str, Texture]:
    """Return a small texture for each kind of height function, by name."""
    from asperity.textures import Fourier, HeightMap, Profile, Sinusoid

    bumps = [0.0, 1.0e-5, 0.0, 2.0e-5]
    return {
        "sinusoids": Sinusoid(1.0e-5, 1.0e-3),
        "sums of waves": Fourier([1.0e-5, 1.0e-5], [[2.0e3, 0.0], [0.0, 3.0e3]]),
        "sums of parallel waves": Fourier([1.0e-5, 1.0e-5], [[2.0e3, 0.0], [3.0e3, 0.0]]),
        "profiles": Profile(bumps, 1.0e-3),
        "maps": HeightMap([bumps] * 4, 1.0e-3),
    }


def precompile(
    laws: Sequence[Law], textures: Mapping[str, Texture], step: Callable[[str], None]
) -> None:
    """Compare laws on textures to compile all functions of a comparison.

    Args:
        laws: the laws.
        textures: textures by name.
        step: called with a description of each step.
    """
    from asperity.analysis.results.compare import compare

    for name, texture in textures.items():

        def report(letter: str, name: str = name) -> None:
            step(f"law {letter} on {name}")

        with cache.bypass_results():
            compare(texture, laws=laws, progress=report)
