"""The program ``asperity`` as the system sees it: streams, interrupts, exit codes."""

from __future__ import annotations

import codecs
import os
import signal
import sys
from contextlib import suppress
from types import FrameType
from typing import NoReturn

from asperity.errors import tell

INTERRUPTED = 130  # 128 + SIGINT, as shells have it
INPUT_OUTPUT = 74  # as sysexits.h has it
INTERNAL_ERROR = 70  # likewise
BROKEN_PIPE = 141  # 128 + SIGPIPE
_TRACEBACK = "ASPERITY_TRACEBACK"
_AGAIN = 1.0  # [s] until an interrupt that has not arrived is raised again

_interrupts: list[int] = []


def main() -> NoReturn:
    """Run the command line; every end has an exit code and at most one line on standard error."""
    status = INTERRUPTED
    with suppress(KeyboardInterrupt):
        signal.signal(signal.SIGINT, _interrupt)
        status = _run()
    _end_interrupts()
    if _interrupts:
        tell("interrupted")
    # An interrupt that came through an exec() of text is remembered: run by -m, Python would then
    # end by the signal, not by the exit code. Any other exec() makes it forget.
    exec("")
    sys.exit(INTERRUPTED if _interrupts else _flushed(status))


def _run() -> int:
    try:
        _open_streams()
        # Imported here, so that an interrupt while it loads ends like any other.
        from asperity.cli.main import main as command_line

        command_line()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever it is: it is said in one line
        return _said(error)
    return 0


def _interrupt(number: int, _frame: FrameType | None) -> None:
    """Interrupt; the second time at once, and never is it forgotten.

    Code that is called back from C may swallow the exception: it is raised again until it arrives
    at :func:`main`.
    """
    if number == signal.SIGINT:
        _interrupts.append(number)
        if len(_interrupts) > 1:
            os._exit(INTERRUPTED)
        if hasattr(signal, "setitimer"):  # Windows has none: there the exit code alone says it
            signal.signal(signal.SIGALRM, _interrupt)
            signal.setitimer(signal.ITIMER_REAL, _AGAIN, _AGAIN)
    raise KeyboardInterrupt


def _end_interrupts() -> None:
    """Let no interrupt come any more: what is written is whole, and the exit code is known."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _open_streams() -> None:
    """Let the standard streams take whatever is written, closed ones included."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:  # closed: else the next file that is opened would be standard output
            os.open(os.devnull, os.O_RDWR)
    sys.stdout = sys.stdout or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - to the end
    sys.stderr = sys.stderr or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - likewise
    codecs.register_error("asperity", _plain_signs)
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="asperity")  # type: ignore[union-attr]  # both are text files
    # Pictures go to files: no window system is asked for, whatever the environment says.
    os.environ["MPLBACKEND"] = "agg"
    # Sums of linear algebra depend on its threads in the last digit: here as in helpers it has one.
    os.environ |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    sys.unraisablehook = lambda _what: None  # an interrupt in a finalizer is told by the exit code


_SIGNS = str.maketrans({
    "µ": "u", "μ": "u", "·": ".", "×": "x", "−": "-", "–": "-", "—": "-", "…": "...", "≤": "<=",
    "≥": ">=", "≈": "~", "∞": "inf", "°": " deg", "→": "->", "∂": "d", "√": "sqrt", "⁺": "+",
    "σ": "sigma", "φ": "phi", "δ": "delta", "κ": "kappa", "λ": "lambda", "∇": "grad ", "•": "*",
    "“": '"', "”": '"', "‘": "'", "’": "'", "π": "pi", "ω": "omega", "Δ": "Delta", "ε": "eps",
    "█": "#", "▇": "#", "▆": "#", "▅": "=", "▄": "=", "▃": "-", "▂": "_", "▁": "_", "║": "|",
    "─": "-", "━": "=", "│": "|", "┃": "|",
})  # fmt: skip


def _plain_signs(error: UnicodeError) -> tuple[str, int]:
    """Write signs that an encoding lacks as the like of them that it has."""
    from unicodedata import normalize

    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end].translate(_SIGNS)
    return normalize("NFKD", text).encode("ascii", "ignore").decode() or "?", error.end


def _said(error: BaseException) -> int:
    """Say what has gone wrong, and return the exit code."""
    if isinstance(error, BrokenPipeError):
        return BROKEN_PIPE  # whoever read the output has enough
    if isinstance(error, OSError) and error.filename is None:
        tell(f"output cannot be written: {error.strerror or error}")
        return INPUT_OUTPUT
    if os.environ.get(_TRACEBACK):
        sys.__excepthook__(type(error), error, error.__traceback__)
        return INTERNAL_ERROR
    import platform
    import shlex

    import asperity

    tell(
        f"a fault of asperity's own, at {shlex.join(['asperity', *sys.argv[1:]])!r}:"
        f" {type(error).__name__}: {' '.join(str(error).split())} ({_place(error)});"
        f" asperity {asperity.__version__}, Python {platform.python_version()},"
        f" {platform.system()}. Please report this line; {_TRACEBACK}=1 shows all of it"
    )
    return INTERNAL_ERROR


def _place(error: BaseException) -> str:
    frame = error.__traceback__
    while frame is not None and frame.tb_next is not None:
        frame = frame.tb_next
    return f"{frame.tb_frame.f_code.co_filename}, line {frame.tb_lineno}" if frame else "nowhere"


def _flushed(status: int) -> int:
    """Return the exit code, or another where standard output does not take its last lines."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError) as error:
        status = status or _said(error)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # for the flush at Python's own end
    return status


if __name__ == "__main__":
    main()
