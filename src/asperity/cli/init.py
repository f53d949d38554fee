"""``asperity init``: a scene to begin with."""

from __future__ import annotations

from pathlib import Path

import click

from asperity.cli.output import check_output, write_output
from asperity.errors import ParameterError, printable


@click.command("init")
@click.argument("scene")
@click.option("--force", is_flag=True, help="Replace a file that is there.")
def command(scene: str, *, force: bool) -> None:
    """Write SCENE (TOML), a scene that runs, with everything that it may say as comments."""
    from asperity.scene.template import scene_template

    path = Path(scene)
    if path.suffix.lower() != ".toml":
        raise ParameterError("scene", "must be a file that ends in .toml", scene)
    check_output("scene", scene)
    if path.exists() and not force:
        raise ParameterError("scene", f"exists: {printable(scene)}; --force replaces it")
    write_output("scene", scene, scene_template(path.name))
    click.echo(f"Written: {printable(scene)}; now: asperity simulate {printable(scene)}")
