"""The program ``asperity``: standard streams, interrupts and exit codes."""

from __future__ import annotations

import codecs
import os
import signal
import sys
from contextlib import suppress
from types import FrameType
from typing import NoReturn

from asperity.core.errors import InternalError, print_message
from asperity.core.processes import SINGLE_THREADED

INTERRUPTED = 130  # 128 + SIGINT, as in shells
IO_ERROR = 74  # as in sysexits.h
BROKEN_PIPE = 141  # 128 + SIGPIPE
_TRACEBACK = "ASPERITY_TRACEBACK"
_REPEAT_INTERVAL = 1.0  # [s] after which an interrupt is raised again

_received_signals: list[int] = []


def main() -> NoReturn:
    """Run the command line; every error is an exit code and one line on standard error."""
    status = INTERRUPTED
    with suppress(KeyboardInterrupt):
        signal.signal(signal.SIGINT, _handle_interrupt)
        status = _run()
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if _received_signals:
        print_message("interrupted")
    # Run with -m, Python ends by the signal instead of the exit code after an interrupt inside an
    # exec() of source text, such as that of a plugin. A later exec() clears that state.
    exec("")
    sys.exit(INTERRUPTED if _received_signals else _flush_output(status))


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


def _handle_interrupt(number: int, _frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt; a second interrupt ends the program at once.

    The exception is raised repeatedly until it arrives in :func:`main`, since code that is called
    back from C may swallow it.
    """
    if number == signal.SIGINT:
        _received_signals.append(number)
        if len(_received_signals) > 1:
            os._exit(INTERRUPTED)
        if hasattr(signal, "setitimer"):  # not on Windows
            signal.signal(signal.SIGALRM, _handle_interrupt)
            signal.setitimer(signal.ITIMER_REAL, _REPEAT_INTERVAL, _REPEAT_INTERVAL)
    raise KeyboardInterrupt


def _prepare_streams() -> None:
    """Make the standard streams accept any output, including closed streams."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:  # closed: the next file to be opened would become this stream
            os.open(os.devnull, os.O_RDWR)
    sys.stdout = sys.stdout or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - to the end
    sys.stderr = sys.stderr or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - likewise
    codecs.register_error("asperity", _replace_unencodable)
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="asperity")  # type: ignore[union-attr]  # both are text files
    os.environ |= {"MPLBACKEND": "agg"} | SINGLE_THREADED  # figures go to files
    # The exit code reports an interrupt in a finalizer.
    sys.unraisablehook = lambda _error: None


# Characters of the output without an ASCII equivalent in NFKD.
_ASCII_REPLACEMENTS = str.maketrans({
    "µ": "u", "×": "x", "−": "-", "–": "-", "≤": "<=", "≥": ">=", "∞": "inf", "°": " deg",
    "·": ".", "→": "->", "σ": "sigma", "⁺": "+",
})  # fmt: skip


def _replace_unencodable(error: UnicodeError) -> tuple[str, int]:
    """Replace characters that the encoding of a stream does not have."""
    from unicodedata import normalize

    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end].translate(_ASCII_REPLACEMENTS)
    return normalize("NFKD", text).encode("ascii", "ignore").decode() or "?", error.end


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
