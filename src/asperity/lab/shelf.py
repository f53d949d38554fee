"""What the page can show again and save: takes of the session, and a recording of elsewhere."""

from __future__ import annotations

import asyncio
from typing import Any

from asperity.errors import ParameterError
from asperity.lab.reel import Reel
from asperity.lab.session import Session
from asperity.lab.stage import Stage
from asperity.lab.takes import take

MOST = 4
"""Takes that are kept, the newest; each is of some megabytes."""
_ARCHIVE, _PIECE = "application/zip", "application/octet-stream"


class Shelf:
    """Takes that can be fetched by name: ``NAME.zip``, ``NAME.0``, ``NAME.1`` and so on.

    Args:
        session: whose stages they are.

    Attributes:
        told: what pages are told of each, the newest last.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._reels: dict[str, Reel] = {}
        self._archives: dict[str, bytes] = {}
        self.told: list[dict[str, Any]] = []
        self._count, self._busy = 0, False

    def lay(self, name: str, reel: Reel, stage: Stage, title: str) -> None:
        """Put a recording on the shelf, which stays there and is shown at once."""
        self._add(name, reel, stage, title=title, opens=True)

    def _add(self, name: str, reel: Reel, stage: Stage, **words: Any) -> dict[str, Any]:
        self._reels[name], self._session.stages.kept[name] = reel, stage
        said = {"name": name, "law": stage.setup.surface.law.letter, "archive": None, **words}
        self.told.append(said | {"reel": reel})
        return self.told[-1]

    async def keep(self) -> dict[str, Any]:
        """Keep the newest seconds of the session.

        Returns:
            What the pages are told of them.

        Raises:
            ParameterError: if there is nothing to keep, or another take is being made.
        """
        session = self._session
        shared = session.shared
        if shared is None or session.state != "running":
            raise ParameterError("recording", "needs a loop that runs")
        if session.wheel is None:
            raise ParameterError("recording", "of a handle is written by asperity run --record")
        if self._busy:
            raise ParameterError("recording", "is being made already")
        self._busy = True
        try:
            made = await asyncio.to_thread(take, session.stage, shared, session.wheel)
            archive = await asyncio.to_thread(made.archive)
        finally:
            self._busy = False
        self._count += 1
        name = f"take-{self._count}"
        self._archives[name] = archive
        if len(self._archives) > MOST:
            self._forget(next(iter(self._archives)))
        return self._add(
            name, made.reel(), made.stage, title=str(self._count), archive=f"{name}.zip"
        )

    def _forget(self, name: str) -> None:
        del self._archives[name], self._reels[name], self._session.stages.kept[name]
        self.told = [said for said in self.told if said["name"] != name]

    async def fetch(self, asked: str) -> tuple[str, bytes] | None:
        """Return type and content of a file by its name; ``None`` if there is none of it."""
        name, _dot, part = asked.rpartition(".")
        if part == "zip" and name in self._archives:
            return _ARCHIVE, self._archives[name]
        reel = self._reels.get(name)
        if reel is None or not part.isdecimal() or int(part) >= reel.pieces:
            return None
        return _PIECE, await asyncio.to_thread(reel.piece, int(part))
