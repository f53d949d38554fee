"""Lanes of the lab: a second law beside the first under the same hand, and the frames of each."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

import numpy as np

from asperity.contacts.warm_start import TRUNCATED_TICKS
from asperity.core.errors import ParameterError
from asperity.lab.background import BackgroundRenderer, BackgroundWorker
from asperity.lab.messages import BESIDE, encode_frame
from asperity.lab.scene_state import SceneState
from asperity.lab.session import Session
from asperity.laws import find_law
from asperity.servo.loop_memory import LoopStatistics


class SecondLane:
    """A law beside that of a session: same hand, surface, stiffness, device and delay.

    Args:
        leader: session whose hand and scene it follows.
        on_change: called after a change of its state, in the thread of its session.
        workers: processes for pictures and limits.
        on_update: called when a picture or a limit is new.

    Attributes:
        law: letter of the law; empty for none.
        session: of the second loop.
        pictures: of its surface.
    """

    def __init__(
        self, leader: Session, on_change: Callable[[], None],
        workers: tuple[BackgroundWorker, BackgroundWorker],
        on_update: Callable[[], Coroutine[Any, Any, None]],
    ) -> None:  # fmt: skip
        self._leader, self.law = leader, ""
        self.session = Session(leader.scene_state, on_change, leader=leader)
        self.pictures = BackgroundRenderer(*workers, on_update, BESIDE)
        self._followed: tuple[SceneState, int, str] | None = None

    def choose(self, letter: str) -> None:
        """Render a law by its letter, or none.

        Raises:
            ParameterError: for an unknown law, or a real device.
        """
        if self._leader.handle is not None:
            words = "needs the simulated device: a hand cannot hold one handle under two laws"
            raise ParameterError(BESIDE, words)
        self.law = find_law(letter).letter if letter else ""
        self._followed = None
        if not letter:
            self.session.release_force("", now=True)

    def update(self) -> None:
        """Follow the leading session, and show the pictures of what is rendered."""
        leader, scene = self._leader, self.session.scene_state
        if self.law and leader.state == "running":
            wanted = leader.scene_state, leader.start_count, self.law
            last = self._followed
            if last is None or last[0] is not wanted[0] or last[1:] != wanted[1:]:
                self._followed = wanted
                self.session.follow(leader.scene_state.with_changes({"law": self.law}))
        if self.law and self.session.state == "running":
            self.pictures.show(scene.setup.rendered, scene.rated_device)

    @property
    def status(self) -> dict[str, Any]:
        """State for the page, with the names of the first lane's."""
        session, pictures = self.session, self.pictures
        return {
            "law": self.law, "state": session.state, "message": session.message,
            "start_count": session.start_count, "settings": session.scene_state.settings,
            "limit": pictures.limit, "surface_version": pictures.version,
            "picture_message": pictures.message, "pictures_current": pictures.is_current,
        }  # fmt: skip


class FrameReader:
    """Rows of a lane that a page has not received yet.

    Args:
        session: of the lane.
        pictures: of its surface.
        leader: session of the first lane, for the second one.
    """

    def __init__(
        self, session: Session, pictures: BackgroundRenderer, leader: Session | None = None
    ) -> None:
        self._session, self._pictures, self._leader = session, pictures, leader
        self._starts, self._seen = -1, 0

    def read(self, frame: float) -> bytes | None:
        """Return the rows since the last call as a frame with a number; ``None`` without any."""
        session, shared = self._session, self._session.shared
        if shared is None:
            return None
        if session.start_count != self._starts:
            self._starts, self._seen = session.start_count, max(shared.row_count - 1, 0)
        rows, first = shared.rows(self._seen)
        if not len(rows):
            return None
        self._seen = first + len(rows)
        counted, progress = LoopStatistics.from_status(shared.status), session.steering_progress
        counts = {
            "frame": frame, "acknowledged": progress["acknowledged"],
            "late": counted.late, "skipped": counted.skipped, "lateness": counted.max_lateness,
            "truncated": shared.search_state[TRUNCATED_TICKS],
        }  # fmt: skip
        if self._leader is not None:
            counts |= _follow_time(rows, self._leader)
        places = np.concatenate([self._pictures.nearest(rows[-1, 1:4]), session.anchor])
        return encode_frame(rows, first, counts, places)


def _follow_time(rows: Any, leader: Session) -> dict[str, float]:
    """Give rows of the second lane the time of the first one; return how far they are behind."""
    assert leader.pointer_hand is not None  # as a loop follows it
    lag, left_out = leader.pointer_hand.follower_lag
    delay = lag * leader.scene_state.setup.servo.period
    if leader.shared is not None and (count := leader.shared.row_count):
        rows[:, 0] += leader.shared.rows(count - 1)[0][-1, 0] - delay - rows[-1, 0]
    return {"lane": 1.0, "late": lag, "skipped": left_out, "lateness": delay}
