"""Run a reader in a subprocess, with limits of time and memory.

SurfaceTopography, trimesh (text STL and OBJ) and tifffile (with Pillow behind it) parse whole files
with their own code: a small damaged file can make them hang, exhaust the memory or crash. All other
readers run in the calling process, which saves the start of another one.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import warnings
from collections.abc import Iterator
from typing import IO, Any

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.core.platform.process_control import PROCESSOR_TIME_SIGNALS, limit_process
from asperity.core.processes import SINGLE_THREADED
from asperity.measured.reader import RawSurface, ReadFunction, ReadingOptions, SurfaceFile

TIME_LIMIT = 20.0
"""Processor time [s] allowed for a small file."""
MEMORY_LIMIT = 10**9
"""Memory [bytes] allowed for a small file."""
_WALL_CLOCK_FACTOR = 6  # wall-clock limit over processor limit: other processes may use the cores
# additional limits for each byte of the file
_SECONDS_PER_BYTE = 1e-6
_BYTES_PER_BYTE = 50


def read_isolated(
    read: ReadFunction, file: SurfaceFile, options: ReadingOptions
) -> RawSurface | None:
    """Return the result of a reader that runs in a subprocess.

    Args:
        read: the reader, a function at module level.
        file: the file to read.
        options: the options of the reader.

    Raises:
        SurfaceFileError: the reader exceeded a limit or crashed, or raised this error itself.
    """
    size = file.path.stat().st_size
    seconds = TIME_LIMIT + _SECONDS_PER_BYTE * size
    memory = MEMORY_LIMIT + _BYTES_PER_BYTE * size
    with tempfile.TemporaryFile() as output:
        code = run_subprocess(read, file, options, (seconds, memory), output)
        if code is None or -code in PROCESSOR_TIME_SIGNALS:
            raise _limit_error(file, f"{seconds:.0f} s")
        if code or not output.tell():
            end = f"signal {signal.Signals(-code).name}" if code < 0 else f"code {code}"
            fault = f"ends its reader with {end}: damaged, or not what it seems"
            raise SurfaceFileError(f"{file.name} {fault}")
        output.seek(0)
        result: RawSurface | Exception | None = pickle.load(output)
    if isinstance(result, MemoryError):
        raise _limit_error(file, f"{memory / 1e9:.1f} GB")
    if isinstance(result, Exception):
        raise result
    return result


def _limit_error(file: SurfaceFile, limit: str) -> SurfaceFileError:
    return SurfaceFileError(
        f"{file.name} takes more than {limit} to be read, the limit; save the heights in another"
        " format (X3P, NPY, text), or, if you trust the file, raise TIME_LIMIT or MEMORY_LIMIT of"
        f" {__name__}"
    )


def run_subprocess(
    read: ReadFunction,
    file: SurfaceFile,
    options: ReadingOptions,
    limits: tuple[float, int],
    output: IO[bytes],
) -> int | None:
    """Run a reader in a new process and wait for its end.

    Args:
        read: the reader.
        file: the file to read.
        options: the options of the reader.
        limits: processor time [s] and memory [bytes].
        output: file that receives the result, see :func:`write_result`.

    Returns:
        The exit code, or minus the number of a signal; None if the process took too long.
    """
    task = pickle.dumps((read, file.path, options, limits)).hex()
    program = f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import main; main()"
    with subprocess.Popen(
        [sys.executable, "-P", "-c", program, task],
        stdin=subprocess.PIPE,  # never written to: it closes when this process ends
        stdout=output,
        stderr=subprocess.DEVNULL,
        env=os.environ | SINGLE_THREADED,
    ) as process:
        try:
            code = process.wait(_WALL_CLOCK_FACTOR * limits[0])
        except subprocess.TimeoutExpired:
            return None
        finally:
            process.kill()
    output.seek(0, os.SEEK_END)  # where the subprocess has written to
    return code


# --- in the subprocess --------------------------------------------------------------------------


def main() -> None:
    """Read the file named by the argument and write the result to standard output."""
    read, path, options, limits = pickle.loads(bytes.fromhex(sys.argv[1]))
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # discards what a library prints
    limit_process(*limits)
    write_result(read, SurfaceFile.open(path), options, output)


def _exit_with_parent() -> None:
    os.read(0, 1)  # returns when the parent has ended, for whatever reason
    os._exit(1)


def write_result(
    read: ReadFunction, file: SurfaceFile, options: ReadingOptions, output: IO[bytes]
) -> None:
    """Write the result of a reader, or the error that it raised, as a pickle."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result: Any = read(file, options)
    except (MemoryError, OSError, ParameterError) as error:
        result = error
    pickle.dump(result, output)
    output.flush()


# --- calls of other libraries -------------------------------------------------------------------


@contextlib.contextmanager
def reject_on_error(fault: str) -> Iterator[None]:
    """Turn the errors of a library in a ``with`` block into a refusal of the file.

    Args:
        fault: what is wrong with the file, for the message.

    Raises:
        SurfaceFileError: for any error except asperity's own and ``MemoryError``: no library
            documents a complete list of its errors.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (ParameterError, MemoryError):
        raise
    except Exception as error:  # any error of the library
        raise SurfaceFileError(f"{fault} ({describe_exception(error)})") from error


def describe_exception(error: Exception) -> str:
    """Return the text of an exception on one line, or its class name if it has none."""
    text = " ".join(str(error).split())
    return f"{text[:117]}..." if len(text) > 120 else text or type(error).__name__
