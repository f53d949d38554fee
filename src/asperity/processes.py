"""Work that other processes of this program do ahead, so that a command uses all cores.

Results never depend on how many there are: whoever shares work out does it all in order, as if
alone, and a helper only works a task out before its turn comes. What a helper finds is handed back,
or kept in the cache, see :mod:`asperity.kept`; whatever goes wrong with one, a task is then done
here. Helpers begin after a moment, or when something compiles: what is answered at once needs none,
and starts none. From Python nothing is shared out unless asked for, by :func:`at_most`.

Threads would not do: Numba compiles under one lock. A fork would copy threads of numerical
libraries half, and what multiprocessing starts imports the user's script again.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from typing import IO, Any

PATIENCE = 1.0
"""Time [s] after which helpers begin at the latest; their own start takes about as long."""

_JOBS: ContextVar[int] = ContextVar("jobs", default=1)


def cores() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def at_most(jobs: int) -> Iterator[None]:
    """Use at most so many processes, this one included."""
    token = _JOBS.set(jobs)
    try:
        yield
    finally:
        _JOBS.reset(token)


@contextmanager
def helped(work: Callable[[Any], Any], tasks: Sequence[Any]) -> Iterator[Iterator[Any]]:
    """Share tasks out: helpers take the last ones, whoever iterates the first.

    Args:
        work: a function of a module, and what it returns, that can be pickled; it is called in the
            helpers.
        tasks: what it is called with, one by one.

    Yields:
        For each task in order, once its turn has come: what a helper has found, or ``None`` where
        none has: then it is to be done here.
    """
    count = min(_JOBS.get(), len(tasks)) - 1
    if count < 1:
        yield iter([None] * len(tasks))
        return
    from asperity.compiled import LISTENERS

    board = _Board(work, tasks)
    LISTENERS.append(board.compiling)
    helpers = [threading.Thread(target=board.help, args=(PATIENCE,)) for _ in range(count)]
    for helper in helpers:
        helper.start()
    try:
        yield board.turns()
    finally:  # after an interrupt too: no process is left behind
        LISTENERS.remove(board.compiling)
        board.stop()
        for helper in helpers:
            helper.join()


class _Board:
    """Which tasks are left, and what was found of the others."""

    def __init__(self, work: Callable[[Any], Any], tasks: Sequence[Any]) -> None:
        self.work, self.tasks = work, tasks
        self.left = deque(range(len(tasks)))
        self.done = [threading.Event() for _ in tasks]
        self.found: list[Any] = [None] * len(tasks)
        self.due, self.over = threading.Event(), threading.Event()
        self.processes: list[subprocess.Popen[bytes]] = []

    def turns(self) -> Iterator[Any]:
        """Yield what helpers have found, waiting for one that is at it."""
        for index in range(len(self.tasks)):
            try:
                self.left.popleft()  # this one: helpers take from the other end
            except IndexError:  # helpers have taken all that were left
                while not self.done[index].wait(0.1):  # in pieces: an interrupt comes through
                    pass
                yield self.found[index]
            else:
                yield None

    def help(self, patience: float) -> None:
        """Have a process of its own do the last task that is left, until there is none."""
        self.due.wait(patience)
        process = None
        while not self.over.is_set():
            try:
                index = self.left.pop()
            except IndexError:
                break
            try:
                process = process or self._start()
                self.found[index] = _asked(process, (self.work, self.tasks[index]))
            except Exception:  # whatever it was, it is met again when the task is done here
                self.found[index] = None
                self.over.set()
            finally:
                self.done[index].set()
        if process is not None:
            _end(process)

    def compiling(self, _name: str) -> None:
        """Let helpers begin: what must be compiled is not answered at once."""
        self.due.set()

    def stop(self) -> None:
        """Let no helper take or finish anything any more."""
        self.over.set()
        self.due.set()
        for process in self.processes:
            process.kill()

    def _start(self) -> subprocess.Popen[bytes]:
        program = f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import serve; serve()"
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", program],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        )  # fmt: skip
        self.processes.append(process)
        if self.over.is_set():  # stopped meanwhile
            process.kill()
        return process


def _asked(process: subprocess.Popen[bytes], question: Any) -> Any:
    assert process.stdin is not None
    assert process.stdout is not None
    _send(process.stdin, pickle.dumps(question))
    fine, answer = pickle.loads(_received(process.stdout))
    if not fine:
        raise RuntimeError(answer)
    return answer


def _end(process: subprocess.Popen[bytes]) -> None:
    for stream in (process.stdin, process.stdout):
        with suppress(OSError):  # it may be dead already
            if stream is not None:
                stream.close()
    process.kill()
    process.wait()


def _send(stream: IO[bytes], content: bytes) -> None:
    stream.write(len(content).to_bytes(8, "big") + content)
    stream.flush()


def _received(stream: IO[bytes]) -> bytes:
    head = stream.read(8)
    content = stream.read(int.from_bytes(head, "big"))
    if len(head) < 8 or len(content) < int.from_bytes(head, "big"):
        raise EOFError
    return content


# --- in the helper --------------------------------------------------------------------------------


def serve() -> None:
    """Be a helper: do what is asked on standard input, until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who shared the work out ends its helpers
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever a library prints
    questions: deque[bytes] = deque()
    come = threading.Semaphore(0)
    threading.Thread(target=_listen, args=(questions, come), daemon=True).start()
    while come.acquire():
        work, task = pickle.loads(questions.popleft())
        try:
            answer: Any = (True, work(task))
        except Exception as error:  # met again by who shared the work out
            answer = (False, repr(error))
        _send(answers, pickle.dumps(answer))


def _listen(questions: deque[bytes], come: threading.Semaphore) -> None:
    """Take questions; end the whole process when there will be none, by whatever end of the other.

    A task may take long: nobody waits for it then.
    """
    with suppress(EOFError):
        while True:
            questions.append(_received(sys.stdin.buffer))
            come.release()
    os._exit(0)
