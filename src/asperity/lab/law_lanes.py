"""Lanes of the lab: a second law beside the first under the same hand, and the frames of each."""

from __future__ import annotations

from typing import Any

import numpy as np

from asperity.contacts.warm_start import TRUNCATED_TICKS
from asperity.core.errors import ParameterError
from asperity.lab.background import BackgroundRenderer
from asperity.lab.messages import BESIDE, encode_frame
from asperity.lab.scene_state import SCENE_KEY
from asperity.lab.session import Session
from asperity.laws import find_law
from asperity.servo.loop_memory import LoopStatistics


class LawLane:
    """A law that is rendered: its loop and its pictures.

    Args:
        session: of the loop.
        pictures: of its surface.

    Attributes:
        session: of the loop.
        pictures: of its surface.
    """

    def __init__(self, session: Session, pictures: BackgroundRenderer) -> None:
        self.session = session
        self.pictures = pictures

    @property
    def status(self) -> dict[str, Any]:
        """State of loop and pictures, for the page."""
        session = self.session
        pictures = self.pictures
        # The session may have changed since the pictures were requested last.
        is_shown = pictures.shows(session.scene_state.setup.rendered)
        return {
            "state": session.state,
            "message": session.message,
            "start_count": session.start_count,
            "settings": session.scene_state.settings,
            "friction": session.scene_state.setup.surface.contact_friction,
            "limit": pictures.limit if is_shown else {},
            "surface_version": pictures.version,
            "picture_message": pictures.message,
            "pictures_current": pictures.is_current and is_shown,
        }


class SecondLane(LawLane):
    """A law beside the first: same hand, surface, stiffness, device and delay.

    Args:
        leader: session of the first lane.
        pictures: of the surface.
    """

    def __init__(self, leader: Session, pictures: BackgroundRenderer) -> None:
        super().__init__(Session(leader.scene_state, leader.on_change, leader=leader), pictures)
        # Scene and start of the first loop, and law, that were requested last.
        self._leader = leader
        self._chosen_law = ""
        self._followed = (0, 0, "")

    @property
    def law(self) -> str:
        """Letter of the law; empty for none, and during the guided tour."""
        return "" if self._leader.is_in_tour else self._chosen_law

    def choose(self, letter: str) -> None:
        """Render a law, by its letter, or none.

        Raises:
            ParameterError: for an unknown law, or a real device.
        """
        if self._leader.handle is not None:
            raise ParameterError(BESIDE, "needs the simulated device: one handle has one law")
        self._chosen_law = find_law(letter).letter if letter else ""
        self._followed = (0, 0, "")
        if not letter:
            self.session.release_force("", now=True)

    def update(self) -> None:
        """Follow the first loop, and show the pictures of what is rendered."""
        leader = self._leader
        session = self.session
        law = self.law
        wanted = id(leader.scene_state), leader.start_count, law
        if not law and (self._followed[2] or session.is_running):  # the tour begins
            self._followed = (0, 0, "")
            session.release_force("", now=True)
        if law and leader.state == "running" and wanted != self._followed:
            if wanted[1] != self._followed[1]:
                session.release_force("", now=True)  # its samples count from zero again
            self._followed = wanted
            session.saved_scenes.scenes[BESIDE] = leader.scene_state
            session.change({SCENE_KEY: BESIDE, "law": law})
        if law and session.state == "running":
            scene = session.scene_state
            self.pictures.show(scene.setup.rendered, scene.rated_device)


class FrameReader:
    """Rows of a lane that a page has not received yet.

    Args:
        lane: the lane.
    """

    def __init__(self, lane: LawLane) -> None:
        self._lane = lane
        self._starts = -1
        self._seen = 0

    def read(self, frame: float) -> bytes:
        """Return the rows since the last call as a frame with a number; empty without any."""
        session = self._lane.session
        shared = self._lane.session.shared
        if shared is None:
            return b""
        if session.start_count != self._starts:
            self._starts = session.start_count
            self._seen = max(shared.row_count - 1, 0)
        rows, first = shared.rows(self._seen)
        if not len(rows):
            return b""
        self._seen = first + len(rows)
        counted = LoopStatistics.from_status(shared.status)
        counts = {
            "frame": frame,
            "acknowledged": session.steering_progress["acknowledged"],
            "late": counted.late,
            "skipped": counted.skipped,
            "lateness": counted.max_lateness,
            "force_limited": counted.force_limited,
            "too_deep": counted.too_deep,
            "deepest": counted.deepest,
            "truncated": shared.search_state[TRUNCATED_TICKS],
        }
        if session.leader is not None:
            counts |= _follow_time(rows, session.leader)
        places = np.concatenate([self._lane.pictures.nearest(rows[-1, 1:4]), session.anchor])
        return encode_frame(rows, first, counts, places)


def _follow_time(rows: Any, leader: Session) -> dict[str, float]:
    """Give rows of the second lane the time of the first; return how far they are behind."""
    assert leader.pointer_hand is not None  # as a loop follows it
    lag, left_out = leader.pointer_hand.follower_lag
    delay = lag * leader.scene_state.setup.servo.period
    if leader.shared is not None and (count := leader.shared.row_count):
        rows[:, 0] += leader.shared.rows(count - 1)[0][-1, 0] - delay - rows[-1, 0]
    return {"lane": 1.0, "late": lag, "skipped": left_out, "lateness": delay}
