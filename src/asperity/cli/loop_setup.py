"""Options and set-up of the commands that run a closed loop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import (
    LAW_OPTIONS,
    Command,
    device_option,
    file_options,
    file_values,
    law_option,
    law_options,
    select_device,
    surface_values,
)
from asperity.cli.output import progress_bar, step_bar
from asperity.core.arguments import STIFFNESS, Argument
from asperity.core.errors import ParameterError, print_message
from asperity.laws import REGISTERED_LAWS, Law, find_law
from asperity.laws.clamps import BACKED

if TYPE_CHECKING:
    from asperity.devices import Device
    from asperity.scene.setup import Setup
    from asperity.servo.driver import Driver
    from asperity.servo.process import PrestartedProcess
    from asperity.simulation.servo import Servo
    from asperity.textures.texture import Texture


def stiffness_option(default: str) -> Argument:
    """Return the declaration of ``--stiffness`` with another default."""
    return replace(STIFFNESS, default=None, default_description=default)


def loop_options(
    stiffness: Argument | None, *, several_laws: bool = False
) -> Callable[[Command], Command]:
    """Return a decorator that adds SCENE and the options of surface, law and device.

    Args:
        stiffness: declaration of ``--stiffness``; ``None`` for a command that finds it, where the
            option is an error and not shown.
        several_laws: whether the command has ``--laws``, which replaces ``--law`` in the help.
    """
    arguments = (stiffness or STIFFNESS, *LAW_OPTIONS[1:])

    def decorate(command: Command) -> Command:
        hidden = () if stiffness else arguments[:1]
        command = law_options(arguments, hidden)(file_options(command))
        help_text = "Device, in place of the scene's.  [default: the scene's, else omega.3]"
        command = device_option(help_text)(command)
        law = law_option("Law, in place of the scene's.", hidden=several_laws)
        return click.argument("scene")(law(command))

    return decorate


def load_setup(
    source: str,
    values: dict[str, Any],
    duration: float | None = None,
    laws: Sequence[Law] = (),
    *,
    include_delay: bool = True,
    driver: str | None = None,
) -> Setup:
    """Return the closed loop of a scene file and the options.

    A loop in real time accepts a surface without a scene: it has a default hand, a clamp, and the
    recommended law and stiffness where they are not set.

    Args:
        source: path of the scene.
        values: values of the options, by name.
        duration: duration of the run [s], in place of the scene's.
        laws: laws that replace the one of the scene.
        include_delay: whether to include the delay of the device.
        driver: driver of a loop in real time; ``None`` for a simulation.

    Raises:
        ParameterError: for a missing, unknown or invalid value.
    """
    from asperity.frictional import check_arguments_apply
    from asperity.scene import load_scene
    from asperity.scene.device_run import without_hand
    from asperity.scene.setup import make_setup

    if driver is None and not source.lower().endswith(".toml"):
        fault = "must be a scene file (.toml) with [texture], [hand] and [motion]"
        raise ParameterError("scene", fault, source)
    requested = surface_values(values)
    if laws:
        requested.setdefault("law", find_law("W"))
    with progress_bar("reading the surface"):
        scene = load_scene(source, file_values(values))
    device = select_device(values["device"], scene, values)
    note = ""
    surface = {**scene.surface, **requested}
    if driver is not None:
        _check_driver(driver, device)
        # A clamp bounds the force, and the analysis then holds at every depth.
        surface = {"clamp": BACKED.name, **surface}
        if not {"law", "stiffness"} <= surface.keys() and "hand" not in scene.loop:
            surface, note = recommend(scene.texture, device, surface)
    if driver not in (None, SIMULATED):
        scene = without_hand(scene)
    if laws or "law" in surface:
        check_arguments_apply(requested, laws or (find_law(surface["law"]),))
    setup = make_setup(
        scene,
        surface=surface,
        device=device,
        duration=duration,
        laws=laws,
        uses_delay=include_delay,
        use_defaults=driver is not None,
    )
    with progress_bar("baking the field") as update:
        return setup.with_rendering([note], update)


def recommend(
    texture: Texture, device: Device, surface: dict[str, Any]
) -> tuple[dict[str, Any], str]:
    """Return surface arguments with the recommended law and stiffness; shows the progress.

    Raises:
        ParameterError: if nothing can be recommended.
    """
    from asperity.scene.device_run import recommend_law_and_stiffness

    count = 1 if "law" in surface else len(REGISTERED_LAWS)
    with step_bar("comparing the laws", count) as step:
        return recommend_law_and_stiffness(texture, device, surface, step)


def _check_driver(name: str, device: Device) -> None:
    """Check a driver and its files before the laws are compared, which takes long."""
    from asperity.servo.driver import IDENTITY_FRAME
    from asperity.servo.drivers.driver_registry import find_driver
    from asperity.servo.drivers.simulated import open_replay

    if name.startswith(REPLAY_PREFIX):
        open_replay(name.removeprefix(REPLAY_PREFIX))
    elif name != SIMULATED:
        kind, argument = find_driver(name, device)
        kind.create(argument, IDENTITY_FRAME).check_library()


def select_laws(laws: tuple[Law, ...] | None, law: Law | None) -> tuple[Law, ...]:
    """Return the laws of ``--laws``, else the one of ``--law``, else all."""
    if laws:
        return laws
    if law is not None:
        return (law,)
    return tuple(REGISTERED_LAWS.values())


SIMULATED = "simulated"
REPLAY_PREFIX = "replay:"


driver_option = click.option(
    "--driver",
    metavar="NAME",
    default=SIMULATED,
    help="'simulated', 'real' (the driver named in the device entry), haply, forcedimension,"
    " openhaptics, ./device.so, or replay:run.mcap.  [default: simulated]",
)
"""Adds ``--driver``."""


def driver_options(command: Command) -> Command:
    """Add ``--driver`` and ``--accept-risk``."""
    help_text = "Allow a stiffness above the stability limit."
    return driver_option(click.option("--accept-risk", is_flag=True, help=help_text)(command))


def driver_setup(
    source: str, values: dict[str, Any], name: str, duration: float | None = None
) -> tuple[Setup, Servo]:
    """Return the set-up for a driver, and the servo parameters of the scene.

    A real device has its own quantisation and delay: the loop adds neither.

    Raises:
        ParameterError: for a missing, unknown or invalid value.
    """
    setup = load_setup(source, values, duration, driver=name)
    if name == SIMULATED or name.startswith(REPLAY_PREFIX):
        return setup, setup.servo
    return setup.on_real_device(), setup.servo


def make_driver(name: str, setup: Setup) -> Driver:
    """Return a driver by its name; for a real device a safety notice is printed.

    Raises:
        ParameterError: for an unknown driver, or a recording that cannot be replayed.
    """
    if name.startswith(REPLAY_PREFIX):
        from asperity.servo.drivers.simulated import replay_driver

        return replay_driver(name.removeprefix(REPLAY_PREFIX), setup.servo.period)
    from asperity.servo.drivers.driver_registry import hardware_driver

    driver = hardware_driver(name, setup.safety.wall, setup.safety.origin, setup.device)
    print_message(
        f"{setup.device.name} is a real device: keep a hand near its switch. If the loop dies:"
        f" {driver.loss_notice}"
    )
    return driver


def prestart_process() -> PrestartedProcess:
    """Start the process of the loop, while the surface is read; it ends with the command."""
    from asperity.servo.process import PrestartedProcess

    process = PrestartedProcess()
    click.get_current_context().call_on_close(process.terminate)
    return process
