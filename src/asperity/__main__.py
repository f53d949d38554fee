"""The program ``asperity``: standard streams, interrupts and exit codes."""

from __future__ import annotations

import gc
import os
import signal
import sys
from typing import NoReturn

from asperity.core.errors import InternalError, print_message
from asperity.core.processes import SINGLE_THREADED

INTERRUPTED = 130  # 128 + SIGINT, as in shells
IO_ERROR = 74  # as in sysexits.h
BROKEN_PIPE = 141  # 128 + SIGPIPE
_TRACEBACK = "ASPERITY_TRACEBACK"
# The process that frees the semaphores of a program that was killed would warn of them.
_NO_WARNING = "ignore:resource_tracker"
_GARBAGE_THRESHOLD = 20_000  # objects: imports and compilers create many, of which few are garbage


def main() -> NoReturn:
    """Run the command line; every error is an exit code and one line on standard error."""
    gc.set_threshold(_GARBAGE_THRESHOLD)
    try:
        status = _flush_output(_run())
    except KeyboardInterrupt:
        print_message("interrupted")
        status = INTERRUPTED
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.exit(status)


def _run() -> int:
    try:
        _prepare_streams()
        # Imported here, so that an interrupt during the import is handled too.
        from asperity.cli.main import main as command_line

        command_line()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    except Exception as error:  # any error is reported in one line
        return _report_error(error)
    return 0


def _prepare_streams() -> None:
    """Make the standard streams accept any output, including closed streams."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:  # closed: the next file to be opened would become this stream
            os.open(os.devnull, os.O_RDWR)
    sys.stdout = sys.stdout or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - to the end
    sys.stderr = sys.stderr or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - likewise
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="replace")  # type: ignore[union-attr]  # both are text files
    os.environ |= {"MPLBACKEND": "agg"} | SINGLE_THREADED  # figures go to files
    os.environ.setdefault("PYTHONWARNINGS", _NO_WARNING)


def _report_error(error: BaseException) -> int:
    """Print a message about an unexpected error, and return the exit code."""
    if isinstance(error, BrokenPipeError):
        return BROKEN_PIPE  # the reader of the output has ended
    if isinstance(error, OSError) and error.filename is None:
        print_message(f"output cannot be written: {error.strerror or error}")
        return IO_ERROR
    if os.environ.get(_TRACEBACK):
        sys.__excepthook__(type(error), error, error.__traceback__)
        return InternalError.exit_code
    import platform
    import shlex
    import traceback

    import asperity

    *_, frame = traceback.extract_tb(error.__traceback__)
    print_message(
        f"internal error in {shlex.join(['asperity', *sys.argv[1:]])!r}:"
        f" {type(error).__name__}: {' '.join(str(error).split())} ({frame.filename},"
        f" line {frame.lineno});"
        f" asperity {asperity.__version__}, Python {platform.python_version()},"
        f" {platform.system()}. Please report this line; {_TRACEBACK}=1 shows the traceback"
    )
    return InternalError.exit_code


def _flush_output(status: int) -> int:
    """Flush standard output, and return the exit code."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError) as error:
        status = status or _report_error(error)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # for the flush when Python ends
    return status


if __name__ == "__main__":
    main()
