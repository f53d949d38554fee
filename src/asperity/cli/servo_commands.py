"""The commands ``run`` and ``lab``."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType
from typing import TYPE_CHECKING, Any

import click

from asperity.cli import loop_setup, options
from asperity.cli.main import declare_command
from asperity.cli.options import file_values, surface_values
from asperity.cli.output import Outputs, check_outputs, output_options, progress_bar
from asperity.cli.plugins import load_plugin_files, plugin_files
from asperity.core.errors import ParameterError, print_message
from asperity.core.platform.console import leave_lost_terminal
from asperity.core.platform.process_control import (
    STOP_NOW_SIGNALS,
    STOP_SIGNALS,
    SUSPEND_SIGNALS,
    suspend_this_process,
)
from asperity.laws.clamps import BACKED

if TYPE_CHECKING:
    from asperity.lab.scene_state import SceneState
    from asperity.lab.session import Handle
    from asperity.scene.setup import Setup
    from asperity.servo.loop_memory import EndReason, LoopMemory
    from asperity.servo.process import PrestartedProcess, ServoProcess


_RUN_ARGUMENTS = options.command_arguments("run")


@declare_command("run")
@loop_setup.loop_options(
    loop_setup.stiffness_option("the scene's; without a scene, the recommended stiffness")
)
@options.argument_options(_RUN_ARGUMENTS)
@loop_setup.driver_options
@click.option("--record", metavar="PATH", help="Write every sample to a recording ('run.mcap').")
@output_options(html=False)
def run_command(
    scene: str,
    outputs: Outputs,
    duration: float | None,
    driver: str,
    record: str | None,
    accept_risk: bool,
    **values: Any,
) -> None:
    """Run SCENE in real time on a simulated device, or on a real one with --driver.

    SCENE is a scene file (TOML), a texture with its arguments or a measured file. Without a scene
    file the law and stiffness are those that compare recommends, and a simulated hand strokes the
    surface for 10 s.

    The loop runs in its own process at the update rate of the device; limits on force, slew rate,
    depth, lateness and energy are set in section [servo] of the scene. Ctrl-C releases the force
    and stops; a fault sets the force to zero and ends with exit code 3. Read docs/howto/safety.md
    before using a real device.
    """
    check_outputs(force=outputs.force, json=outputs.json, record=record)
    from asperity.scene.device_run import check_stiffness_limit

    process = loop_setup.prestart_process()
    setup, _servo = loop_setup.driver_setup(scene, values, driver, duration)
    hashes = setup.file_hashes()
    with progress_bar("analyzing the surface"):
        check_stiffness_limit(setup, accept_risk=accept_risk)
    from asperity.report.pages.run_report import device_run_page
    from asperity.servo.loop_memory import DeviceFault

    loop = make_loop(setup, driver, duration, process)
    with stop_on_signals(loop.memory) as signals:
        try:
            with progress_bar("compiling the loop"):
                loop.start()
            with record_loop(record, loop, setup) as write_rows:
                reason = watch_loop(loop, signals, write_rows)
                loop.stop()
        except DeviceFault:
            print_fault_summary(loop, record)
            raise
        finally:
            loop.stop()
    suspend_if_requested(signals)
    for path, current in setup.file_hashes().items():
        if hashes.get(path, current) != current:
            print_message(f"{path} was changed during the run, which used the earlier content")
    data = {
        "schema": 1,
        "scene": setup,
        "driver": driver,
        "ended": reason.name.lower(),
        "notes": loop.notes,
        "statistics": loop.statistics,
    }
    outputs.write(data, device_run_page(setup, loop, reason, record))


def make_loop(
    setup: Setup, driver_name: str, duration: float | None, process: PrestartedProcess
) -> ServoProcess:
    """Return the loop of a driver; a replay without a duration ends with its rows.

    Raises:
        ParameterError: for an unknown driver, or a device without a maximum force.
    """
    from asperity.scene.device_run import simulated_process
    from asperity.servo.process import ServoProcess

    if driver_name == loop_setup.SIMULATED:
        return simulated_process(setup, process)
    driver = loop_setup.make_driver(driver_name, setup)
    if duration is None and driver.max_readings is not None:
        duration = setup.servo.period * driver.max_readings
    reach = setup.safety.reach_limit(setup.device)
    return ServoProcess(
        setup.rendered, driver, setup.servo, setup.safety, reach, duration, prestarted=process
    )


@contextmanager
def stop_on_signals(memory: LoopMemory | None = None) -> Iterator[list[int]]:
    """Stop the loop of a memory at each of ``STOP_SIGNALS``; yield the list of those received."""
    received: list[int] = []

    def collect(number: int, _frame: FrameType | None) -> None:
        if memory is not None:
            memory.request_stop(now=number in STOP_NOW_SIGNALS)
        received.append(number)

    handlers = {number: signal.signal(number, collect) for number in STOP_SIGNALS}
    try:
        yield received
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def suspend_if_requested(signals: list[int]) -> None:
    """Suspend this program if Ctrl-Z ended its loop, which does not start again by itself."""
    if not {*SUSPEND_SIGNALS}.isdisjoint(signals):
        suspend_this_process()


@contextmanager
def record_loop(path: str | None, loop: ServoProcess, setup: Setup) -> Iterator[Callable[[], None]]:
    """Record a loop if there is a path; yield a function that writes the new rows."""
    if path is None:
        yield lambda: None
        return
    from asperity.servo.process import LoopRecorder

    metadata = setup.recording_metadata(loop.driver.name)
    with LoopRecorder(path, loop, setup.rendered, setup.servo, metadata) as recorder:
        yield recorder.write_new_rows
    if lost := recorder.lost_rows:
        print_message(f"{lost} rows are missing in the recording: this program was too slow")


def print_fault_summary(loop: ServoProcess, path: str | None) -> None:
    """Print the timing of a loop that ended by a fault, and which recording holds its samples."""
    from asperity.report.sentences.loop_text import timing_lines

    if not loop.statistics.samples:
        return
    for line in timing_lines(loop.statistics):
        print_message(line)
    if path is not None:
        print_message(f"Recording: {path} holds the samples until then")


def watch_loop(loop: ServoProcess, signals: list[int], write_rows: Callable[[], None]) -> EndReason:
    """Poll a running loop until it ends, and return the reason.

    Args:
        loop: the loop.
        signals: received signals, which stop the loop.
        write_rows: called at each poll.

    Raises:
        DeviceFault: for a fault.
    """
    from asperity.scene.device_run import POLL_INTERVAL
    from asperity.servo.loop_memory import EndReason

    for note in loop.notes:
        print_message(note)
    with show_live_state() as show:
        while (reason := loop.poll()) is EndReason.RUNNING:
            if leave_lost_terminal() or signals:
                loop.stop()
                continue
            write_rows()
            show(loop)
            time.sleep(POLL_INTERVAL)
    return reason


@contextmanager
def show_live_state() -> Iterator[Any]:
    """Show position, force, energy and lateness, if standard error is a terminal."""
    if not sys.stderr.isatty():
        yield lambda _loop: None
        return
    from rich.console import Console
    from rich.live import Live

    from asperity.report.sentences.loop_text import status_line

    with Live(console=Console(stderr=True), transient=True, refresh_per_second=20) as live:
        yield lambda loop: live.update(status_line(loop))


_LAB_ARGUMENTS = options.command_arguments("lab")


@declare_command("lab")
@click.argument("surface", required=False)
@options.law_option(
    "Initial law.  [default: the scene's, else the recommended law, or C if there is none]"
)
@options.law_options(
    (
        loop_setup.stiffness_option(
            "the scene's, else the recommended stiffness, or 250 N/m if there is none"
        ),
        *options.LAW_OPTIONS[1:],
    )
)
@options.file_options
@options.device_option("Device.  [default: the scene's, else omega.3]")
@loop_setup.driver_options
@options.argument_options(_LAB_ARGUMENTS)
def lab_command(
    surface: str | None,
    port: int | None,
    driver: str,
    *,
    accept_risk: bool,
    no_browser: bool,
    **values: Any,
) -> None:
    """Run SURFACE interactively in a browser, with the loop of asperity run.

    On the simulated device the mouse pointer acts as the hand. With --driver the loop runs on a
    real device and is started, changed and stopped from the page: read docs/howto/safety.md first.
    Without SURFACE, a sinusoid is used. The page is served on this machine only, to anyone who has
    the printed address, and loads nothing from a network. Ctrl-C stops the lab.
    """
    # Started first, since it takes long in another process.
    process = loop_setup.prestart_process()
    import asyncio

    from asperity.lab.access import bind_socket
    from asperity.lab.scene_state import DEFAULT_SURFACE
    from asperity.lab.server import LabOptions, serve_lab

    source = surface or DEFAULT_SURFACE
    print_message(f"reading {source}; the address of the lab follows")
    handle = None
    if driver == loop_setup.SIMULATED:
        scene = _simulated_scene(source, values)
    else:
        scene, handle = _device_scene(source, values, driver, accept_risk=accept_risk)

    open_page = partial(announce_page, "lab", no_browser=no_browser)
    load = partial(load_plugin_files, plugin_files())
    options = LabOptions(load, process, handle, accept_risk)
    asyncio.run(serve_lab(scene, bind_socket(port), open_page, options))


def _simulated_scene(source: str, values: dict[str, Any]) -> SceneState:
    """Return the initial scene on the simulated device."""
    from asperity.lab.scene_state import make_scene_state
    from asperity.scene import load_scene

    requested_surface = surface_values(values)
    file_options = file_values(values)
    with progress_bar("reading the surface"):
        scene = load_scene(source, file_options)
    device = options.select_device(values["device"], scene, values)
    if not {"law", "stiffness"} <= scene.surface.keys() | requested_surface.keys():
        # Without a recommendation, and for wrong parameters, the defaults of the lab apply.
        with suppress(ParameterError):
            requested = {
                "clamp": BACKED.name,
                **scene.surface,
                **requested_surface,
            }  # as the lab renders it
            requested_surface, note = loop_setup.recommend(scene.texture, device, requested)
            print_message(note)
    return make_scene_state(scene, source, requested_surface, device)


def announce_page(name: str, address: str, *, no_browser: bool) -> None:
    """Print the address of a page, and open it in a browser."""
    import webbrowser

    print_message(f"the {name} is at {address}")
    if not no_browser and not webbrowser.open(_write_redirect(address, _temporary_folder())):
        print_message("no browser was found: open the address in a browser of this machine")


def _write_redirect(address: str, folder: Path) -> str:
    """Return the address of a file that leads to the page and that only this user can read.

    The command line of the browser, which every user of the machine sees, then holds no token.
    """
    path = folder / "asperity-lab.html"
    path.write_text(f'<!DOCTYPE html><meta http-equiv="refresh" content="0; url={address}">')
    path.chmod(0o600)
    return path.as_uri()


def _temporary_folder() -> Path:
    """Return a folder that is deleted when the command ends."""
    return Path(click.get_current_context().with_resource(TemporaryDirectory()))


def _device_scene(
    source: str, values: dict[str, Any], name: str, *, accept_risk: bool
) -> tuple[SceneState, Handle]:
    """Return the scene on the device of a driver, and its handle.

    Raises:
        ParameterError: for an unknown driver, a device without a maximum force, or a stiffness
            above the limit.
    """
    from asperity.lab.scene_state import make_device_scene_state
    from asperity.lab.session import make_handle
    from asperity.scene.device_run import check_stiffness_limit
    from asperity.servo.process import require_max_force

    setup, servo = loop_setup.driver_setup(source, values, name)
    driver = loop_setup.make_driver(name, setup)
    require_max_force(driver, setup.servo)
    with progress_bar("analyzing the surface"):
        check_stiffness_limit(setup, accept_risk=accept_risk)
    scene = make_device_scene_state(setup, servo, source)
    return scene, make_handle(driver, setup, "; asperity lab --accept-risk renders it")
