"""The process beside the loop: it knows the user's own laws too, and another follows it."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any

import numpy as np
import pytest
from tests.lab.conftest import OWN_LAW

import asperity as asp
from asperity.analysis.passivity.criteria import CRITERIA
from asperity.cli.own_code import learn
from asperity.devices import load_device
from asperity.lab import workshop
from asperity.lab.backdrop import MOST_ENDS, Backdrop
from asperity.lab.messages import Look
from asperity.lab.stage import make_stage
from asperity.lab.workshop import Workshop
from asperity.scene import load_scene
from asperity.scene.setup import Setup
from asperity.textures import Sinusoid


def test_a_law_of_the_users_own_is_shown(own_law: dict[str, Any]) -> None:
    (letter,) = own_law
    surface = asp.Surface(Sinusoid(0.1e-3, 2e-3), letter, stiffness=100.0, max_depth=3e-4)
    with Workshop(partial(learn, (OWN_LAW,))) as other:
        other.submit(workshop.show, surface).result()
        relief = np.frombuffer(other.submit(workshop.picture, "relief", (0.0, 0.0, 8e-3)).result())
    assert relief[0] == 2.0
    assert np.abs(relief[5:]).max() > 0.9e-4


LOOK = Look("relief", (0.0, 0.0, 8e-3))


class Deadly(Workshop):
    """One whose process ends of each surface, as often as is said."""

    deaths, shown = 0, 0

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        if work is workshop.show:
            self.shown += 1
            if self.shown <= self.deaths:
                return super().submit(os.abort)
        return super().submit(work, *arguments)


@pytest.fixture(scope="module")
def setup() -> Setup:
    return make_stage(load_scene("sinusoid:amplitude=0.2mm,period=2mm")).setup


async def reached(said: list[str], backdrop: Backdrop, version: int) -> None:
    """Wait until pictures can be had; what is said meanwhile is noted."""

    async def look() -> None:
        while backdrop.version < version:
            said.append(backdrop.words)
            await asyncio.sleep(0.01)

    await asyncio.wait_for(look(), 120.0)


def test_another_process_follows_one_that_was_killed(setup: Setup) -> None:
    async def scenario(pictures: Workshop, limits: Workshop) -> None:
        said: list[str] = []
        backdrop = Backdrop(pictures, limits, lambda: asyncio.sleep(0.0))
        backdrop.show(setup.surface, setup.device)
        await reached(said, backdrop, 1)
        before = await backdrop.picture(LOOK)
        assert not any(said)
        assert len(before) > 1000
        for other in (pictures, limits):
            os.kill(await asyncio.wrap_future(other.submit(os.getpid)), signal.SIGKILL)
        # Two pages ask at once; one of them finds out.
        assert await asyncio.gather(backdrop.picture(LOOK), backdrop.picture(LOOK)) == [b"", b""]
        await reached(said, backdrop, 2)
        assert "has ended: another one begins" in said[-1]
        assert backdrop.words == ""
        assert await backdrop.picture(LOOK) == before
        # Its limit is asked of the other one that was killed.
        backdrop.show(setup.with_law("W").surface, setup.device)
        while not backdrop.limit:
            await asyncio.sleep(0.01)
        assert backdrop.limit["stiffness"] > 0.0

    with Workshop() as pictures, Workshop() as limits:
        asyncio.run(asyncio.wait_for(scenario(pictures, limits), 240.0))


def test_a_surface_that_ends_each_process_is_given_up(setup: Setup) -> None:
    async def scenario(pictures: Deadly, limits: Workshop) -> None:
        pictures.deaths = 10
        backdrop = Backdrop(pictures, limits, lambda: asyncio.sleep(0.0))
        backdrop.show(setup.surface, setup.device)
        while "ended each time" not in backdrop.words:
            await asyncio.sleep(0.01)
        await asyncio.sleep(0.5)
        assert pictures.shown == MOST_ENDS
        assert await backdrop.picture(LOOK) == b""
        # Another surface begins anew.
        pictures.deaths = MOST_ENDS + 1
        backdrop.show(setup.with_law("W").surface, setup.device)
        await reached([], backdrop, 1)
        assert backdrop.words == ""
        assert len(await backdrop.picture(LOOK)) > 1000

    with Deadly() as pictures, Workshop() as limits:
        asyncio.run(asyncio.wait_for(scenario(pictures, limits), 240.0))


def test_another_device_has_another_limit_of_the_same_pictures(setup: Setup) -> None:
    async def scenario(pictures: Workshop, limits: Workshop) -> None:
        found = []
        backdrop = Backdrop(pictures, limits, lambda: asyncio.sleep(0.0))
        for name in ("touch-x", "omega.3", "omega.3", "touch-x"):
            backdrop.show(setup.surface, load_device(name))
            while not backdrop.limit:
                await asyncio.sleep(0.01)
            found.append(backdrop.limit)
        assert backdrop.version == 1
        assert found[1] is found[2]
        assert found[0] == found[3]
        assert found[0]["stiffness"] < 0.5 * found[1]["stiffness"]
        # By the name that the analysis prints.
        assert {limit["criterion"] for limit in found} <= {*CRITERIA}
        analysis = asp.analyze(setup.surface, device="omega.3")
        names = [one.name for one in analysis.passivity.criteria]
        assert found[1]["criterion"] in names

    with Workshop() as pictures, Workshop() as limits:
        asyncio.run(asyncio.wait_for(scenario(pictures, limits), 240.0))
