"""The exported force on a Cortex-M4F: flash, RAM, and instructions in a tick.

The sketch ``examples/export/cortex_m.c`` is compiled for a Cortex-M4F. Its object code is run by
QEMU's user mode, which knows no Cortex-M: Thumb-2 and single precision are the same on a Cortex-A,
so the mark of the profile is taken off and the start-up code of a Cortex-A is linked.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from asperity.export.c99 import c99_files
from asperity.export.surface_functions import ExportRequest
from asperity.surface import Surface
from bench.speed import c_programs
from bench.speed.c_programs import run_command

SKETCH = Path(__file__).parents[2] / "examples" / "export" / "cortex_m.c"
TOOLS = ("arm-none-eabi-gcc", "arm-none-eabi-objcopy", "arm-none-eabi-size", "qemu-arm")
STRICT = (*c_programs.STRICT, "-Wdouble-promotion")
SMALL = ("-Os", "-ffunction-sections", "-Wl,--gc-sections", "--specs=rdimon.specs")
MICRO = ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16")
HOST = ("-mcpu=cortex-a7", "-mthumb", "-mfloat-abi=hard", "-mfpu=vfpv4-d16")


def missing_tool() -> str | None:
    """Return the first of the tools that this machine lacks."""
    return next((tool for tool in TOOLS if shutil.which(tool) is None), None)


@dataclass(frozen=True)
class Firmware:
    """A sketch on a microcontroller.

    Attributes:
        flash: bytes of code and constants, the mathematical library's included; not those of the
            program around it.
        ram: bytes of variables, but for the stack.
        instructions: executed in a tick, the mean of many.
        output: what the sketch printed.
    """

    flash: int
    ram: int
    instructions: float
    output: str


def build_firmware(surface: Surface, folder: Path) -> Firmware:
    """Build the sketch of a surface, and run it."""
    order = ExportRequest(surface, precision="float")
    for name, text in c99_files(order, "texture").items():
        (folder / name).write_text(text, encoding="utf-8")
    sources = [SKETCH, *folder.glob("texture_data.c")]
    whole, empty = folder / "sketch.elf", folder / "empty.elf"
    given = (*STRICT, *SMALL, *MICRO, "-DSILENT", f"-I{folder}")
    run_command(TOOLS[0], *given, *sources, "-lm", "-o", whole)
    (folder / "empty.c").write_text(
        "#include <stdlib.h>\nint main(int n, char **w) { return n > 1 ? atoi(w[1]) : 8; }\n"
    )
    run_command(TOOLS[0], *given, folder / "empty.c", "-o", empty)
    size, nothing = (_sizes(one) for one in (whole, empty))
    shown = _build_runnable(folder, sources, "shown")
    silent = _build_runnable(folder, sources, "silent", "-DSILENT")
    few, many = (_count_instructions(folder, silent, ticks) for ticks in (50, 150))
    return Firmware(
        flash=size[0] - nothing[0],
        ram=size[1] - nothing[1],
        instructions=(many - few) / 100.0,
        output=run_command(TOOLS[3], "-cpu", "cortex-a15", shown, "8"),
    )


def _sizes(program: Path) -> tuple[int, int]:
    """Return flash (code, constants, first values) and RAM (variables) in bytes."""
    text, data, bss = map(int, run_command(TOOLS[2], program).splitlines()[1].split()[:3])
    return text + data, data + bss


def _build_runnable(folder: Path, sources: list[Path], name: str, *flags: str) -> Path:
    """Return a program of the microcontroller's object code that QEMU's user mode runs."""
    objects = []
    for source in sources:
        made = folder / f"{name}_{source.stem}.o"
        run_command(
            TOOLS[0], *STRICT, "-Os", *MICRO, *flags, f"-I{folder}", "-c", source, "-o", made
        )
        run_command(TOOLS[1], "--remove-section", ".ARM.attributes", made)
        objects.append(made)
    program = folder / f"{name}.elf"
    run_command(TOOLS[0], *HOST, "--specs=rdimon.specs", *objects, "-lm", "-o", program)
    return program


def _count_instructions(folder: Path, program: Path, ticks: int) -> int:
    """Return how many instructions a run takes."""
    log = folder / "executed.log"
    traced = ("-singlestep", "-d", "exec,nochain", "-D", log, "-cpu", "cortex-a15")
    run_command(TOOLS[3], *traced, program, str(ticks))
    with log.open(encoding="utf-8", errors="replace") as lines:
        return sum(line.startswith("Trace") for line in lines)
