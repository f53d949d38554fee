"""``asperity cache``: what is kept between runs, and how much of it."""

from __future__ import annotations

from collections.abc import Iterable

import click

from asperity import cache
from asperity.cli.output import Outputs, output_options
from asperity.errors import AsperityError, printable

_ROOMS = {
    "answers": "answers about surfaces",
    "certificates": "certified numbers of large surfaces",
    "code": "compiled laws, textures and loops",
}


@click.command("cache")
@click.option("--clear", is_flag=True, help="Delete all of it; it is made again when it is needed.")
@output_options(None, "Write the list as JSON; - is standard output.")
def command(outputs: Outputs, *, clear: bool) -> None:
    """Say what is kept between runs: where, how much, and how much it may be.

    What was not used for longest goes first. ASPERITY_CACHE_DIR names another folder,
    ASPERITY_CACHE_SIZE another size, such as 500MB. Any command takes --no-cache.
    """
    before = cache.entries()
    left = cache.clear() if clear else before
    folder, limit = cache.cache_folder(), cache.size_limit()
    rooms = sorted({*_ROOMS, *(entry.room for entry in left)})
    kept = {room: [entry for entry in left if entry.room == room] for room in rooms}
    data = {
        "schema": 1, "folder": str(folder), "limit": limit,
        "rooms": [
            {"name": room, "entries": len(some), "size": _size(some)} for room, some in kept.items()
        ],
    }  # fmt: skip

    def say() -> Iterable[str]:
        yield f"{printable(str(folder))}: {_megabytes(_size(left))} of at most {_megabytes(limit)}"
        for room, some in kept.items():
            words = _ROOMS.get(room, "of another version")
            yield f"  {room:<13} {len(some):>6} {_megabytes(_size(some)):>10}  {words}"
        if clear:
            yield f"Deleted: {len(before) - len(left)} entries"

    outputs.write(data, lambda console: console.print("\n".join(say()), markup=False))
    if clear and left:
        raise AsperityError(f"{len(left)} entries of {folder} cannot be deleted")


def _size(some: Iterable[cache.Entry]) -> int:
    return sum(entry.size for entry in some)


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"
