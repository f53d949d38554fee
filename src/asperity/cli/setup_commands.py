"""The commands ``init``, ``devices``, ``calibrate``, ``doctor``, ``cache`` and ``warm``."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli import options, output
from asperity.cli.loop_setup import SIMULATED
from asperity.cli.main import declare_command
from asperity.cli.options import jobs_option
from asperity.cli.output import Outputs, check_outputs, output_options, progress_bar, write_output
from asperity.cli.servo_commands import stop_on_signals, suspend_if_requested
from asperity.core import cache
from asperity.core.errors import AsperityError, ParameterError, escape_unprintable, print_message
from asperity.core.units import count_text

if TYPE_CHECKING:
    from asperity.devices import Device
    from asperity.servo.calibration.excitation import CalibrationRig
    from asperity.simulation.servo import Servo


@declare_command("init")
@click.argument("scene")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def init_command(scene: str, *, force: bool) -> None:
    """Write a template scene to SCENE (TOML).

    It can be simulated as it is; all other settings are comments.
    """
    from asperity.scene.scene_keys import scene_template

    text = scene_template(Path(scene).name)
    output.write_template("scene", scene, text, "asperity simulate {}", force=force)


_NAMESPACE_LABELS = {
    cache.RESULTS_NAMESPACE: "results of surfaces",
    "code": "compiled laws, textures and loops",
}


@declare_command("cache")
@click.option("--clear", is_flag=True, help="Delete all entries.")
@output.output_options(html=False, uses_cache=False)
def cache_command(outputs: output.Outputs, *, clear: bool) -> None:
    """Show the directory, size and limit of the cache, or clear it.

    If the cache exceeds its limit, the least recently used entries are deleted first.
    ASPERITY_CACHE_DIR sets another directory, ASPERITY_CACHE_SIZE another limit, such as 500MB.
    Commands that compute accept --no-cache.
    """
    before = cache.list_entries()
    entries = cache.clear() if clear else before
    folder = cache.cache_folder()
    limit = cache.size_limit()
    names = sorted({*_NAMESPACE_LABELS, *(entry.namespace for entry in entries)})
    sizes = {name: [entry.size for entry in entries if entry.namespace == name] for name in names}
    total = _format_megabytes(entry.size for entry in entries)
    lines = [f"{escape_unprintable(str(folder))}: {total} of at most {_format_megabytes([limit])}"]
    for name, parts in sizes.items():
        label = _NAMESPACE_LABELS.get(name, "of another version, not used by this one")
        lines.append(f"  {name:<13} {len(parts):>6} {_format_megabytes(parts):>10}  {label}")
    if clear:
        lines.append(f"Deleted: {len(before) - len(entries)} entries")
    rooms = [
        {"name": name, "entries": len(parts), "size": sum(parts)} for name, parts in sizes.items()
    ]
    data = {"schema": 1, "folder": str(folder), "limit": limit, "rooms": rooms}
    from asperity.report.document.page import Paragraph, terminal_page

    outputs.write(data, terminal_page(Paragraph("\n".join(lines), "code")))
    if clear and entries:
        raise AsperityError(f"{len(entries)} entries of {folder} cannot be deleted")


def _format_megabytes(sizes: Iterable[int]) -> str:
    return f"{sum(sizes) / 1e6:.1f} MB"


@declare_command("doctor")
@output.output_options(html=False, uses_cache=False)
def doctor_command(outputs: output.Outputs) -> None:
    """Describe this machine for a report of a fault.

    Shows the system, versions, real-time priority, the timing of a simulated loop of 2 s, which
    drivers find the library or service of their vendor, and the cache. No device is moved.
    """
    from asperity.report.document.page import Paragraph, terminal_page
    from asperity.report.sentences.loop_text import machine_lines
    from asperity.scene.doctor import examine_machine

    with progress_bar("running a simulated loop"):
        report = examine_machine()
    lines = Paragraph("\n".join(machine_lines(report)), "code")
    outputs.write({"schema": 1, **report.to_dict()}, terminal_page(lines))


@declare_command("warm")
@jobs_option
@click.option(
    "--pack",
    metavar="FOLDER",
    help="Write the code into this folder of a package, for all processors of x86-64-v3 or arm64.",
)
def warm_command(pack: str | None) -> None:
    """Compile the shipped laws for every texture kind and store the code in the cache.

    Functions that are in the cache are not compiled again. Afterwards, comparisons of shipped
    laws compile nothing, nor do simulate, run and lab on the default device with the code that
    --pack writes, which make dist calls.
    """
    from asperity.lab import precompile
    from asperity.laws import LAWS

    laws = tuple(LAWS.values())
    textures = precompile.sample_textures()
    works = [precompile.precompile]
    if pack is not None:
        works.append(precompile.precompile_loops)
    count = len(works) * len(textures) * len(laws)
    with precompile.packing(pack), output.step_bar("compiling", count) as step:
        for work in works:
            work(laws, textures, step)
    click.echo(f"Compiled: {count_text(len(laws), 'law')} on {', '.join(textures)}")


@declare_command("devices")
@click.argument("names", nargs=-1, metavar="[ID|FILE]...")
@click.option(
    "--template",
    is_flag=True,
    help="Print a template of a device file, with the unit of every field.",
)
@output_options(html=False, uses_cache=False)
def devices_command(names: tuple[str, ...], outputs: Outputs, *, template: bool) -> None:
    """List the devices of the catalogue and the source of each value.

    With IDs, or device files (TOML), show every value with its unit, its source, and whether
    it was verified. To describe another device: asperity devices --template > mine.toml
    """
    from asperity.devices import device_names, load_device
    from asperity.devices.device_file import device_template
    from asperity.report.pages.catalogue_report import devices_page

    if template:
        if names or outputs.json:
            raise ParameterError("template", "prints a device file: it accepts no other arguments")
        click.echo(device_template(), nl=False)
        return
    devices = [load_device(name) for name in names or device_names()]
    data = {"schema": 1, "devices": devices}
    outputs.write(data, devices_page(devices, detailed=bool(names)))


MAX_CALIBRATION_FORCE = 3.0
"""Default limit of the force of a calibration [N]."""
_FORCE_FRACTION = 1.0 / 3.0  # of the device's maximum force
_DEFAULT_RATE = 1000.0  # [Hz] for a device without an update rate

_CALIBRATE = options.command_arguments("calibrate")


@declare_command("calibrate")
@options.device_option("The device with its known values: ID of the catalogue, or a TOML file.")
@click.option(
    "--driver",
    metavar="NAME",
    default=SIMULATED,
    help="'simulated', 'real' (the driver named in the device entry), or another driver of asperity"
    " run.  [default: simulated, without a real device]",
)
@options.argument_options(_CALIBRATE)
@options.set_option
@options.plugin_option
@click.option("-o", "--output", metavar="FILE", required=True, help="Device file (TOML) to write.")
@click.option("--yes", is_flag=True, help="Start without confirmation: the handle will move.")
@output_options(html=False, keeps=False)
def calibrate_command(
    outputs: Outputs,
    device: Device | None,
    driver: str,
    force: float | None,
    settings: options.Overrides,
    output: str,
    *,
    yes: bool,
) -> None:
    """Calibrate a device: noise, resolution, rate, delay, mass, damping, friction, stiffest wall.

    The device moves the handle back and forth along each axis and then holds it with a smooth wall
    whose stiffness increases until a limit cycle begins; the force is then set to zero at once. Do
    not touch the handle. Keep a hand near the power or force switch. Ctrl-C releases the force, and
    nothing is written. Read docs/howto/safety.md before using a real device.
    """
    from asperity.analysis.passivity.recommended_stiffness import unit_starts
    from asperity.devices import load_device
    from asperity.devices.device_file import to_device_toml
    from asperity.servo.calibration.calibrator import Calibrator
    from asperity.servo.calibration.measured_device import measured_device

    check_outputs(force=outputs.force, json=outputs.json, output=output)
    if Path(output).suffix.lower() != ".toml":
        raise ParameterError("output", "must be a device file that ends in .toml", output)
    if device is None:
        raise ParameterError(
            "device", "is missing: give --device ID, or a TOML file with the known values"
        )
    base = settings.apply_to(load_device(device))
    simulated = driver == SIMULATED
    max_force = force or default_force(base, real=not simulated)
    with (
        stop_on_signals() as signals,
        calibration_rig(base, driver, max_force, signals, yes=yes) as rig,
        progress_bar("compiling the loop") as update,
    ):
        result = Calibrator(rig, RAMP_TIME, lambda step: update(0.0, step)).run()
    suspend_if_requested(signals)
    date = time.strftime("%Y-%m-%d")
    stem = Path(output).stem
    calibrated = measured_device(base, result, stem, date, simulated=simulated)
    write_output("output", output, to_device_toml(calibrated))
    from asperity.report.pages.run_report import calibration_page

    before = unit_starts(base)
    after = unit_starts(calibrated)
    starts = {law: (before[law], after[law]) for law in after}
    data = {"schema": 1, "device": calibrated, "measured": result, "unit_starts": starts}
    outputs.write(data, calibration_page(calibrated, result, output, starts))


RAMP_TIME = 0.02
"""Time in which each force rises and falls [s]."""


def default_force(device: Device, *, real: bool) -> float:
    """Return the default maximum force of a calibration [N].

    Raises:
        ParameterError: for a real device without a maximum force.
    """
    maximum = device.value("max_force")
    continuous = device.value("continuous_force")
    if maximum is None and real:
        raise ParameterError("max_force", "is unknown: give --set max_force=3N")
    force = MAX_CALIBRATION_FORCE if maximum is None else _FORCE_FRACTION * maximum
    return min(force, MAX_CALIBRATION_FORCE, force if continuous is None else continuous)


@contextmanager
def calibration_rig(
    device: Device, driver: str, force: float, signals: list[int], *, yes: bool
) -> Iterator[CalibrationRig]:
    """Yield the rig of a calibration.

    Args:
        device: the device with its known values.
        driver: name of the driver.
        force: maximum force [N].
        signals: received signals, which stop the calibration.
        yes: whether to start without confirmation.
    """
    from asperity.servo.calibration.excitation import ClockedRig, UnclockedRig
    from asperity.servo.drivers.driver_registry import hardware_driver
    from asperity.servo.safety import Safety
    from asperity.simulation.servo import Servo

    maximum = device.value("max_force")
    if maximum is not None and force > maximum:
        raise ParameterError("force", f"must be at most the device's {maximum:g} N", force)
    servo = Servo(1.0 / (device.value("update_rate") or _DEFAULT_RATE), max_force=force)
    safety = Safety(ramp=RAMP_TIME, max_slew=1e3 * force)

    def check() -> None:
        if signals:
            print_message("stopped without force; nothing is written")
            raise KeyboardInterrupt

    if driver == SIMULATED:
        yield UnclockedRig(simulated_bench_driver(device, servo), servo, safety, check)
        return
    hardware = hardware_driver(driver, "lying", (0.0, 0.0, 0.0), device)
    confirm_motion(device, hardware.loss_notice, force, yes=yes)
    with ClockedRig(hardware, servo, safety, safety.reach_limit(device), check) as rig:
        for note in rig.loop.notes:
            print_message(note)
        yield rig


def simulated_bench_driver(device: Device, servo: Servo) -> Any:
    """Return the driver of a simulated device with its own quantisation and delay."""
    from dataclasses import replace

    from asperity.scene.scene_defaults import make_plant, make_servo, with_assumed_mass
    from asperity.servo.drivers.simulated import simulated_driver
    from asperity.simulation import SpringHand, Stationary

    whole, assumed = with_assumed_mass(device)
    plant, plant_notes = make_plant(whole)
    device_servo, servo_notes = make_servo(device)
    for note in (*assumed, *plant_notes, *servo_notes):
        print_message(note)
    device_servo = replace(device_servo, period=servo.period)
    motion = Stationary((0.0, 0.0, 0.0))
    return simulated_driver(
        plant, SpringHand(), device_servo, motion, servo.period, device_resolution=True
    )


def confirm_motion(device: Device, when_lost: str, force: float, *, yes: bool) -> None:
    """Ask the user to confirm that the handle may move.

    Raises:
        ParameterError: without a confirmation.
    """
    print_message(
        f"{device.name} is a real device: do not touch the handle, and keep a hand near the"
        f" switch. The handle moves with up to {force:g} N. If the loop dies: {when_lost}"
    )
    if not yes and not output.is_confirmed("Start?"):
        raise ParameterError("yes", "is missing: the handle moves by itself; --yes starts it")
