"""Where tasks run: processes of this machine, or a Dask cluster. Both give results as they come."""

import ipaddress
import os
import signal
import socket
import threading
import time
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import urlsplit

from joblib.externals.loky import ProcessPoolExecutor

from experiments.sweep.task import Task, VersionError, perform
from railsim.errors import InputError, Noticed

THREADS = dict.fromkeys(
    (
        "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS",
        "NUMEXPR_NUM_THREADS", "NUMBA_NUM_THREADS",
    ),
    "1",
)  # fmt: skip
"""One thread a worker: the workers are the parallelism, and sums do not depend on a number of threads."""

ANSWER = 10.0  # s that a scheduler has to answer, and its workers to be there
_TLS = "DASK_DISTRIBUTED__COMM__TLS"
MOST_DEATHS = 3  # in a row without a result between them
_WATCH = 1.0  # s between two looks whether the parent is alive

Finished = tuple[Task, dict[str, Any]]


class Executor(Protocol):
    """Something that performs tasks."""

    @property
    def workers(self) -> int:
        """How many tasks run at a time."""
        ...

    def run(self, tasks: Sequence[Task]) -> Iterator[Finished]:
        """Tasks with their results, in the order in which they end."""
        ...

    def close(self) -> None:
        """Let go of the workers; what runs is given up."""
        ...


class Local:
    """Processes of this machine (joblib's loky). A process that dies is replaced and its tasks run again."""

    def __init__(self, jobs: int, scratch: Path, keep_truth: bool) -> None:
        self._jobs, self._scratch, self._keep = jobs, str(scratch), keep_truth
        self._pool: Any = None
        self._idle = True

    @property
    def workers(self) -> int:
        """Number of processes."""
        return self._jobs

    def run(self, tasks: Sequence[Task]) -> Iterator[Finished]:
        """The first task alone, so that one process compiles what is not compiled yet; then all.

        Raises
        ------
        InputError : processes die again and again, or a worker raises what is not a failure of its task.
        """
        left = {task.number: task for task in tasks}
        deaths = 0
        while left:
            try:
                for task, result in self._until_broken(list(left.values())):
                    deaths = 0
                    del left[task.number]
                    yield task, result
            except BrokenProcessPool:
                deaths += 1
                self.close()
                if deaths == MOST_DEATHS:
                    raise InputError(
                        f"worker processes ended {deaths} times in a row (killed, or out of memory); what is finished "
                        "is kept: run again with fewer --jobs or shorter runs"
                    ) from None

    def _until_broken(self, tasks: Sequence[Task]) -> Iterator[Finished]:
        if self._pool is None:
            self._pool = ProcessPoolExecutor(
                max_workers=self._jobs, initializer=_begin, initargs=(os.getpid(),), env=THREADS
            )
        waiting, running = list(reversed(tasks)), {}
        self._idle = False
        while waiting or running:
            room = 1 if len(waiting) == len(tasks) else 2 * self._jobs
            while waiting and len(running) < room:
                task = waiting.pop()
                running[self._pool.submit(perform, task, self._scratch, self._keep)] = task
            for future in wait(list(running), return_when=FIRST_COMPLETED).done:
                task = running.pop(future)
                yield task, _result(future)
        self._idle = True

    def close(self) -> None:
        """End the processes; what they are at is given up."""
        if self._pool is not None:
            self._pool.shutdown(wait=True, kill_workers=not self._idle)
            self._pool = None


def check_address(address: str, hint: str) -> None:
    """See at once whether somebody listens at a cluster's address, and say where others may listen in.

    Raises
    ------
    InputError : not the address of a scheduler, or nobody listens there.
    """
    parts = urlsplit(address if "://" in address else f"tcp://{address}")
    try:
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if parts.scheme not in ("tcp", "tls") or not host or not port or parts.path:
        raise InputError(f"--cluster '{address}': give the scheduler as HOST:PORT or tls://HOST:PORT; {hint}")
    try:
        with socket.create_connection((host, port), ANSWER) as line:
            near = ipaddress.ip_address(line.getpeername()[0]).is_loopback
    except (OSError, UnicodeError) as error:
        raise InputError(f"no Dask scheduler answers at '{address}' ({error}); {hint}") from None
    if parts.scheme == "tcp" and not near:
        text = f"the scheduler at '{address}' is not protected: whoever reaches it runs programs as its workers; use tls://"
        warnings.warn(text, Noticed, stacklevel=2)


class Cluster:
    """A Dask cluster whose workers have the package installed; tasks of a lost worker run again elsewhere."""

    def __init__(self, address: str, keep_truth: bool) -> None:
        try:
            import distributed
        except ImportError:
            raise InputError("--cluster needs Dask distributed; install it: pip install 'railsim[cluster]'") from None
        self._distributed: Any = distributed
        self._keep = keep_truth
        hint = "start 'dask scheduler --host 127.0.0.1' there and workers with 'dask worker ADDRESS --nthreads 1'"
        check_address(address, hint)
        try:
            self._client: Any = distributed.Client(address, timeout=ANSWER, set_as_default=False)
        except (OSError, TimeoutError, ValueError, AssertionError) as error:
            reason = " ".join(str(error).split())[:120] or type(error).__name__
            raise InputError(f"no Dask scheduler answers at '{address}' ({reason}); {hint}") from None
        except TypeError:
            names = ", ".join(
                f"DASK_DISTRIBUTED__COMM__TLS__{one}" for one in ("CA_FILE", "CLIENT__CERT", "CLIENT__KEY")
            )
            raise InputError(f"--cluster {address}: TLS needs certificates; set {names}") from None
        self.workers = self._count()
        if not self.workers:
            self.close()
            raise InputError(f"the Dask scheduler at '{address}' has no workers; {hint}")

    def _count(self) -> int:
        """Threads of all workers, waited for."""
        with suppress(TimeoutError, OSError):
            self._client.wait_for_workers(1, timeout=ANSWER)
        return sum(self._client.nthreads().values())

    def run(self, tasks: Sequence[Task]) -> Iterator[Finished]:
        """As many tasks in flight as keep all workers busy.

        Raises
        ------
        InputError : the cluster is lost, or a task ends its worker again and again.
        """
        waiting, running = list(reversed(tasks)), {}
        done = self._distributed.as_completed(loop=self._client.loop)
        try:
            while waiting or running:
                while waiting and len(running) < 2 * max(1, self.workers):
                    task = waiting.pop()
                    future = self._client.submit(perform_on_cluster, task, self._keep, pure=False)
                    running[future.key] = task
                    done.add(future)
                future = next(done)
                task = running.pop(future.key)
                yield task, _result(future)
                future.release()
        except (self._distributed.KilledWorker, self._distributed.comm.CommClosedError, TimeoutError) as error:
            raise InputError(f"the cluster gave up: {error}; what is finished is kept: run again") from None
        except self._distributed.client.FutureCancelledError as error:
            raise InputError(f"the cluster was lost: {error}; what is finished is kept: run again") from None

    def close(self) -> None:
        """Leave the cluster, which goes on without us."""
        self._client.close(timeout=ANSWER)


def perform_on_cluster(task: Task, keep_truth: bool) -> dict[str, Any]:
    """`perform` on a Dask worker, in the folder that the worker clears up after a crash."""
    from distributed import get_worker

    return perform(task, get_worker().local_directory, keep_truth)


def _result(future: "Future[dict[str, Any]] | Any") -> dict[str, Any]:
    try:
        return future.result()
    except VersionError as error:
        raise InputError(str(error)) from None


def _begin(parent: int) -> None:
    """At a process's start: Ctrl-C is the parent's business, and without the parent there is nothing to do."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
