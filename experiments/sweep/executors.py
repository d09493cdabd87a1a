"""Where tasks run: processes of this machine, or a Dask cluster. Both give results as they come."""

import ctypes
import ipaddress
import math
import os
import signal
import socket
import threading
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import urlsplit

from joblib.externals.loky import ProcessPoolExecutor

from experiments.sweep.task import Task, VersionError, perform_group
from railsim.errors import InputError, Noticed

THREADS = dict.fromkeys(
    (
        "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS",
        "NUMEXPR_NUM_THREADS", "NUMBA_NUM_THREADS",
    ),
    "1",
)  # fmt: skip
"""One thread a worker: the workers are the parallelism, and sums do not depend on a number of threads."""

GROUP_SECONDS = 4.0  # that a group of tasks may take
MOST_IN_GROUP = 16

ANSWER = 10.0  # s that a scheduler has to answer, and its workers to be there
_TLS = "DASK_DISTRIBUTED__COMM__TLS"
MOST_DEATHS = 3  # in a row without a result between them
_WATCH = 1.0  # s between two looks whether the parent is alive

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of malloc.h
MAPPED = 32 * 2**20  # bytes of an array from which on it is mapped: the most that glibc takes
KEPT = 512 * 2**20  # bytes that are free and stay with the process: those of the runs of a group

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


class Groups:
    """Tasks in groups, each of which a worker does in one go: its runs are simulated together.

    A group is as large as takes some seconds, so that little is lost with a worker; no result depends on it.
    """

    def __init__(self, tasks: Sequence[Task], workers: int) -> None:
        self._waiting, self._workers = list(reversed(tasks)), workers
        self._seconds = math.inf

    @property
    def left(self) -> int:
        """Tasks that nobody has taken."""
        return len(self._waiting)

    def take(self) -> list[Task]:
        """The next group; one task while nobody knows how long one takes."""
        fair = math.ceil(len(self._waiting) / (2 * self._workers))  # so that all workers are busy to the end
        size = max(1, min(int(GROUP_SECONDS / self._seconds), MOST_IN_GROUP, fair))
        return [self._waiting.pop() for _ in range(min(size, len(self._waiting)))]

    def learn(self, result: Mapping[str, Any]) -> None:
        """How long a task took; the first ones also compile and load, the last one counts as much as all before."""
        seconds = max(result["ended"] - result["began"], 1e-3)
        self._seconds = seconds if math.isinf(self._seconds) else (self._seconds + seconds) / 2


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
                max_workers=self._jobs, initializer=begin_worker, initargs=(os.getpid(),), env=THREADS
            )
        groups, running = Groups(tasks, self._jobs), {}
        self._idle = False
        while groups.left or running:
            room = 1 if groups.left == len(tasks) else 2 * self._jobs
            while groups.left and len(running) < room:
                group = groups.take()
                running[self._pool.submit(perform_group, group, self._scratch, self._keep)] = group
            for future in wait(list(running), return_when=FIRST_COMPLETED).done:
                group = running.pop(future)
                for task, result in zip(group, _results(future), strict=True):
                    groups.learn(result)
                    yield task, result
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
        groups, running = Groups(tasks, max(1, self.workers)), {}
        done = self._distributed.as_completed(loop=self._client.loop)
        try:
            while groups.left or running:
                while groups.left and len(running) < 2 * max(1, self.workers):
                    group = groups.take()
                    future = self._client.submit(perform_on_cluster, group, self._keep, pure=False)
                    running[future.key] = group
                    done.add(future)
                future = next(done)
                group = running.pop(future.key)
                for task, result in zip(group, _results(future), strict=True):
                    groups.learn(result)
                    yield task, result
                future.release()
        except (self._distributed.KilledWorker, self._distributed.comm.CommClosedError, TimeoutError) as error:
            raise InputError(f"the cluster gave up: {error}; what is finished is kept: run again") from None
        except self._distributed.client.FutureCancelledError as error:
            raise InputError(f"the cluster was lost: {error}; what is finished is kept: run again") from None

    def close(self) -> None:
        """Leave the cluster, which goes on without us."""
        self._client.close(timeout=ANSWER)


def perform_on_cluster(group: Sequence[Task], keep_truth: bool) -> list[dict[str, Any]]:
    """`perform_group` on a Dask worker, in the folder that the worker clears up after a crash."""
    from distributed import get_worker

    keep_freed_memory()
    return perform_group(group, get_worker().local_directory, keep_truth)


@cache
def keep_freed_memory() -> None:
    """Let this process use freed memory again (glibc alone; mallopt(3)).

    A page that comes from the system is cleared first, which costs more than the run that fills it. A Dask nanny sets
    MALLOC_TRIM_THRESHOLD_, by which glibc also stops to adapt the size from which on an array is mapped anew.
    """
    libc = ctypes.CDLL(None)
    if hasattr(libc, "mallopt"):
        libc.mallopt(_MMAP_THRESHOLD, MAPPED)
        libc.mallopt(_TRIM_THRESHOLD, KEPT)


def _results(future: "Future[list[dict[str, Any]]] | Any") -> list[dict[str, Any]]:
    try:
        return future.result()
    except VersionError as error:
        raise InputError(str(error)) from None


def begin_worker(parent: int) -> None:
    """At a process's start: Ctrl-C is the parent's business, and without the parent there is nothing to do."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    keep_freed_memory()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
