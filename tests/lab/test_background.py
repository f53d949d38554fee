"""The process beside the loop: it knows the user's own laws too, and another follows it."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from typing import Any

import numpy as np
import pytest
from tests.lab.conftest import OWN_LAW

import asperity as asp
from asperity.analysis.passivity.criteria import CRITERIA
from asperity.cli.plugins import load_plugin_files
from asperity.devices import load_device
from asperity.lab.background import (
    MAX_CRASHES,
    BackgroundRenderer,
    BackgroundResult,
    BackgroundWorker,
    compute_recommendation,
    render_view,
    set_surface,
)
from asperity.lab.messages import ViewRequest
from asperity.lab.scene_state import make_scene_state
from asperity.scene import load_scene
from asperity.scene.setup import Setup
from asperity.textures import Sinusoid


def test_a_law_of_the_users_own_is_shown(own_law: dict[str, Any]) -> None:
    (letter,) = own_law
    surface = asp.Surface(Sinusoid(0.1e-3, 2e-3), letter, stiffness=100.0, max_depth=3e-4)
    with BackgroundWorker(partial(load_plugin_files, (OWN_LAW,))) as other:
        other.submit(set_surface, surface).result()
        relief = np.frombuffer(other.submit(render_view, "relief", (0.0, 0.0, 8e-3)).result())
    assert relief[0] == 2.0
    assert np.abs(relief[5:]).max() > 0.9e-4


LOOK = ViewRequest("relief", (0.0, 0.0, 8e-3))


class Deadly(BackgroundWorker):
    """One whose process ends of each surface, as often as is said."""

    deaths, shown = 0, 0

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        if function is set_surface:
            self.shown += 1
            if self.shown <= self.deaths:
                return super().submit(os.abort)
        return super().submit(function, *arguments)


@pytest.fixture(scope="module")
def setup() -> Setup:
    return make_scene_state(load_scene("sinusoid:amplitude=0.2mm,period=2mm")).setup


async def reached(said: list[str], backdrop: BackgroundRenderer, version: int) -> None:
    """Wait until pictures can be had; what is said meanwhile is noted."""

    async def look() -> None:
        while backdrop.version < version:
            said.append(backdrop.message)
            await asyncio.sleep(0.01)

    await asyncio.wait_for(look(), 120.0)


def test_another_process_follows_one_that_was_killed(setup: Setup) -> None:
    async def scenario(pictures: BackgroundWorker, limits: BackgroundWorker) -> None:
        said: list[str] = []
        backdrop = BackgroundRenderer(pictures, limits, lambda: None)
        backdrop.show(setup.surface, setup.device)
        await reached(said, backdrop, 1)
        before = await backdrop.render(LOOK)
        assert not any(said)
        assert len(before) > 1000
        for other in (pictures, limits):
            os.kill(await asyncio.wrap_future(other.submit(os.getpid)), signal.SIGKILL)
        # Two pages ask at once; one of them finds out.
        assert await asyncio.gather(backdrop.render(LOOK), backdrop.render(LOOK)) == [b"", b""]
        await reached(said, backdrop, 2)
        assert "has crashed and is restarted" in said[-1]
        assert backdrop.message == ""
        assert await backdrop.render(LOOK) == before
        # Its limit is asked of the other one that was killed.
        backdrop.show(setup.with_law("W").surface, setup.device)
        while not backdrop.limit:
            await asyncio.sleep(0.01)
        assert backdrop.limit["stiffness"] > 0.0

    with BackgroundWorker() as pictures, BackgroundWorker() as limits:
        asyncio.run(asyncio.wait_for(scenario(pictures, limits), 240.0))


def test_a_surface_that_ends_each_process_is_given_up(setup: Setup) -> None:
    async def scenario(pictures: Deadly, limits: BackgroundWorker) -> None:
        pictures.deaths = 10
        backdrop = BackgroundRenderer(pictures, limits, lambda: None)
        backdrop.show(setup.surface, setup.device)
        while "crashed each time" not in backdrop.message:
            await asyncio.sleep(0.01)
        await asyncio.sleep(0.5)
        assert pictures.shown == MAX_CRASHES
        assert await backdrop.render(LOOK) == b""
        # Another surface begins anew.
        pictures.deaths = MAX_CRASHES + 1
        backdrop.show(setup.with_law("W").surface, setup.device)
        await reached([], backdrop, 1)
        assert backdrop.message == ""
        assert len(await backdrop.render(LOOK)) > 1000

    with Deadly() as pictures, BackgroundWorker() as limits:
        asyncio.run(asyncio.wait_for(scenario(pictures, limits), 240.0))


def test_another_device_has_another_limit_of_the_same_pictures(setup: Setup) -> None:
    async def scenario(pictures: BackgroundWorker, limits: BackgroundWorker) -> None:
        found = []
        backdrop = BackgroundRenderer(pictures, limits, lambda: None)
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

    with BackgroundWorker() as pictures, BackgroundWorker() as limits:
        asyncio.run(asyncio.wait_for(scenario(pictures, limits), 240.0))


def test_the_recommendation_is_that_of_compare(setup: Setup) -> None:
    surface, device = setup.surface, load_device("omega.3")
    result = asp.compare(surface.texture, device, clamp=surface.clamp)
    row = result.recommended_row
    assert row is not None
    found = compute_recommendation(surface.texture, device, surface.max_depth, surface.clamp)
    assert found["reason"] == result.recommendation
    assert found["changes"]["law"] == result.recommended
    assert found["changes"]["stiffness"] == row.recommended_stiffness
    assert found["limit"]["stiffness"] == row.stability_limit.stiffness
    assert found["tier"] == row.tier
    # What cannot be compared is said, in the words of compare.
    with pytest.raises(asp.ParameterError) as refused:
        asp.compare(surface.texture, "2diy")
    found = compute_recommendation(surface.texture, load_device("2diy"), 1e-4, "none")
    assert found == {"reason": str(refused.value)}


class Counted(BackgroundWorker):
    """One that does its work at once, and crashes as often as is said."""

    crashes = 0

    def __init__(self) -> None:
        self.seen: list[int] = []

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        self.seen.append(arguments[0])
        result: Future[Any] = Future()
        if len(self.seen) <= self.crashes:
            result.set_exception(BrokenProcessPool())
        else:
            asyncio.get_running_loop().call_later(
                0.05, lambda: result.set_result(function(*arguments))
            )
        return result


def test_of_many_requests_only_the_newest_counts() -> None:
    async def scenario(crashes: int) -> tuple[list[int], dict[str, Any], int]:
        updates: list[int] = []
        worker = Counted()
        worker.crashes = crashes
        note = partial(updates.append, 1)
        result = BackgroundResult(worker, lambda number: {"square": number**2}, note)
        tasks = []
        for number in (1, 2, 3):
            assert result.request(number)
            assert not result.request(number)
            tasks.append(asyncio.create_task(result.compute()))
            await asyncio.sleep(0.0)
        await asyncio.gather(*tasks)
        return worker.seen, result.value, len(updates)

    # The first had begun, the second never does.
    assert asyncio.run(scenario(0)) == ([1, 3], {"square": 9}, 1)
    seen, value, updates = asyncio.run(scenario(10))
    assert (seen, updates) == ([1, 3, 3], 1)
    assert "crashed twice" in value["reason"]
