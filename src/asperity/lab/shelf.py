"""The takes of a session, for the page to show and to save."""

from __future__ import annotations

import asyncio
from typing import Any

from asperity.errors import ParameterError
from asperity.lab.session import Session
from asperity.lab.takes import take

MOST = 4
"""Takes that are kept, the newest; each is of some megabytes."""
_ARCHIVE, _TABLE = "application/zip", "application/octet-stream"


class Shelf:
    """Takes that can be fetched by name.

    Attributes:
        files: type and content, by name.
    """

    def __init__(self) -> None:
        self.files: dict[str, tuple[str, bytes]] = {}
        self._count, self._busy = 0, False

    async def keep(self, session: Session) -> dict[str, Any]:
        """Keep the newest seconds of a session.

        Returns:
            What the page is told: names of the files, settings, duration.

        Raises:
            ParameterError: if there is nothing to keep, or another take is being made.
        """
        shared = session.shared
        if shared is None or session.state != "running":
            raise ParameterError("recording", "needs a loop that runs")
        if self._busy:
            raise ParameterError("recording", "is being made already")
        self._busy = True
        try:
            made = await asyncio.to_thread(take, session.stage, shared, session.wheel)
            archive = await asyncio.to_thread(made.archive)
            table = await asyncio.to_thread(made.shown)
        finally:
            self._busy = False
        self._count += 1
        names = f"take-{self._count}.zip", f"take-{self._count}.rows"
        self.files |= {names[0]: (_ARCHIVE, archive), names[1]: (_TABLE, table)}
        for name in list(self.files)[: -2 * MOST]:
            del self.files[name]
        return {"number": self._count, "archive": names[0], "table": names[1], **made.to_dict()}
