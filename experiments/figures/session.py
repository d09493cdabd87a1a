"""Many figures in one go: on all cores, kept as they are finished, with the time that is left."""

import os
import resource
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from joblib.externals.loky import ProcessPoolExecutor

from experiments.figures import costs
from experiments.figures.countdown import Countdown
from experiments.figures.interface import FIGURES, Figure, publish, publish_table, try_folder
from experiments.figures.kept import Kept, inputs_digest
from experiments.figures.parted import PartedFigure, parts_of
from experiments.reporting.logs import tell
from experiments.reporting.size import Size
from experiments.sweep.executors import THREADS, begin_worker
from experiments.sweep.run import Interrupted
from railsim.errors import InputError
from railsim.progress import counting

LOOK = 60.0  # s between two lines where nothing ends

Say = Callable[[str], None]
Result = dict[str, Any]


@dataclass(frozen=True)
class Piece:
    """What one process does in one go: a part of a figure, or the figure; of parts that are kept, what remains."""

    figure: str
    part: str = ""

    @property
    def name(self) -> str:
        """How progress calls it."""
        return f"{self.figure}/{self.part}" if self.part else self.figure


def publish_all(
    names: Sequence[str], folder: Path, size: Size, jobs: int, say: Say = tell, again: bool = False
) -> dict[str, Result]:
    """Publish figures, those that are finished in the folder not again; the dearest pieces first.

    Parameters
    ----------
    names : of the figures. folder : of pictures and tables. jobs : processes. say : is told how far it is.
    again : finished figures too; parts of one that was stopped still count.

    Returns
    -------
    What `publish` gave, by name in the order of `names`.

    Raises
    ------
    InputError : as a figure raises it, the folder cannot be written, or a process is lost. Interrupted : Ctrl-C. What
    is finished is kept.
    """
    try_folder(folder)
    kept = Kept(folder, size, inputs_digest())
    results = {} if again else {name: result for name in names if (result := kept.result(name))}
    left = [name for name in names if name not in results]
    work = _Work(kept, results, say)
    pieces = [piece for name in left for piece in work.pieces(name)]
    work.countdown = Countdown([piece.name for piece in pieces], _costs(pieces, size), jobs)
    say(f"{len(names)} figures, {len(results)} finished before; {work.countdown.beforehand()}")
    work.waiting = sorted(pieces, key=lambda piece: -work.countdown.cost(piece.name))[::-1]
    perform = _here if min(jobs, len(pieces)) == 1 else _on_processes
    try:
        perform(work, jobs)
    except KeyboardInterrupt:
        raise Interrupted("interrupted; what is finished is kept: the same command goes on") from None
    return {name: results[name] for name in names}


def publish_one(figure: Figure, folder: Path, size: Size) -> Result:
    """Publish a figure in one piece, with a bar by the time that it took last; as of `publish`."""
    before = _processor()
    with counting(costs.known(size).get(figure.name), figure.name, "s", by_clock=True):
        result = publish(figure, folder, size)
    costs.learn(size, figure.name, _processor() - before)
    return result


def _costs(pieces: Sequence[Piece], size: Size) -> dict[str, float]:
    """Processor time by piece, s; where a part's is not known, its share of the figure's."""
    known = costs.known(size)
    counts = {piece.figure: len(parts_of(FIGURES.pick(piece.figure)(), size)) for piece in pieces if piece.part}
    found = {piece.name: known[piece.name] for piece in pieces if piece.name in known}
    for piece in pieces:
        if piece.part and piece.figure in known:
            found.setdefault(piece.name, known[piece.figure] / counts[piece.figure])
    return found


@dataclass
class _Work:
    """What waits, the dearest last, and what comes of it."""

    kept: Kept
    results: dict[str, Result]
    say: Say
    countdown: Countdown = field(default_factory=lambda: Countdown([], {}, 1))
    waiting: list[Piece] = field(default_factory=list)
    _missing: dict[str, int] = field(default_factory=dict)

    def pieces(self, figure: str) -> list[Piece]:
        """The parts of a figure that are not kept; the figure, where there are none."""
        parts = parts_of(FIGURES.pick(figure)(), self.kept.size)
        missing = [Piece(figure, part) for part in parts if self.kept.part(figure, part) is None]
        self._missing[figure] = len(missing)
        return missing or [Piece(figure)]

    def next(self) -> Piece:
        """The dearest piece, or what remains of a figure whose parts are there."""
        piece = self.waiting.pop()
        self.countdown.begin(piece.name)
        return piece

    def take(self, piece: Piece, result: Result | None, seconds: float) -> None:
        """Keep the result and what it cost; of a figure whose last part this was, the rest is next."""
        if result is not None:
            self.kept.keep(piece.figure, result)
            self.results[piece.figure] = result
        costs.learn(self.kept.size, piece.name, seconds)
        took = self.countdown.end(piece.name)
        if piece.part:
            self._missing[piece.figure] -= 1
            if not self._missing[piece.figure]:
                self.waiting.append(Piece(piece.figure))
                self.countdown.add(piece.figure, 0.0)
        self.say(f"{piece.name}: {took:.0f} s; {self.countdown.status()}")


def _here(work: _Work, jobs: int) -> None:
    del jobs
    while work.waiting:
        piece = work.next()
        work.take(piece, *made(piece, work.kept))


def _on_processes(work: _Work, jobs: int) -> None:
    """As many pieces at a time as there are processes, so that what runs is known; idle ones cost nothing."""
    running = dict[Future[Any], Piece]()
    pool: Any = ProcessPoolExecutor(max_workers=jobs, initializer=begin_worker, initargs=(os.getpid(),), env=THREADS)
    try:
        while work.waiting or running:
            while work.waiting and len(running) < jobs:
                piece = work.next()
                running[pool.submit(made, piece, work.kept)] = piece
            done = wait(list(running), LOOK, FIRST_COMPLETED).done
            for future in done:
                work.take(running.pop(future), *future.result())
            if not done:
                work.say(work.countdown.status())
    except BrokenProcessPool:
        cure = "what is finished is kept: call it again, with --jobs 1 where memory is short"
        raise InputError(f"a process of the figures was killed or ran out of memory; {cure}") from None
    finally:
        pool.shutdown(wait=True, kill_workers=bool(running))


def made(piece: Piece, kept: Kept) -> tuple[Result | None, float]:
    """A figure's result, or None of a part, which is kept; and processor time in seconds, that of a figure with its
    parts and of processes that it started.
    """
    before = _processor()
    figure = FIGURES.pick(piece.figure)()
    if piece.part:
        table = parts_of(figure, kept.size)[piece.part]()
        seconds = _processor() - before
        kept.keep_part(piece.figure, piece.part, table, seconds)
        return None, seconds
    if not isinstance(figure, PartedFigure):
        return publish(figure, kept.folder, kept.size), _processor() - before
    found = [kept.part(piece.figure, part) for part in figure.parts(kept.size)]
    tables = [one for one in found if one is not None]
    if len(tables) < len(found):
        raise InputError(f"parts of '{piece.figure}' in '{kept.folder}' were removed meanwhile: call it again")
    result = publish_table(figure, figure.join([table for table, _ in tables]), kept.folder)
    return result, sum(seconds for _, seconds in tables) + _processor() - before


def _processor() -> float:
    used = [resource.getrusage(whose) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)
