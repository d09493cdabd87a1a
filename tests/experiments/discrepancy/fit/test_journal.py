"""A stopped case finds what was done, bit by bit; one that is through leaves nothing."""

from pathlib import Path

import numpy as np
import pytest

from experiments.cli import main
from experiments.discrepancy.baseline.evidence import Evidence
from experiments.discrepancy.baseline.forward import Forward
from experiments.discrepancy.fit.fitting import Fit, Problem, improved, starting_fit
from experiments.discrepancy.fit.journal import Journal, journal_of, key_of
from experiments.discrepancy.result import explain


def _same(a: Fit, b: Fit) -> bool:
    names = ("z", "shares", "residual", "stacked", "columns", "jacobian")
    return a.effects == b.effects and all(np.array_equal(getattr(a, name), getattr(b, name)) for name in names)


def test_a_fit_that_is_done_is_not_done_again(problem: Problem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    z = np.zeros(len(problem.forward.nuisances))
    z[0] = 0.5
    start = starting_fit(problem, z)
    plain = improved(problem, start)
    keeping = problem.but(journal=Journal(tmp_path))
    first = improved(keeping, start)

    def fails(*given: object) -> None:
        raise AssertionError("ran again")

    monkeypatch.setattr(Forward, "run", fails)
    again = improved(keeping, start)
    assert _same(plain, first) and _same(first, again)
    with pytest.raises(AssertionError, match="ran again"):  # from another start it is another fit
        improved(keeping, starting_fit_at(start, 0.4))


def starting_fit_at(start: Fit, share: float) -> Fit:
    return Fit(share * start.z, (), start.shares, (), start.residual, start.stacked, start.columns, start.jacobian)


def test_it_stays_when_stopped_and_goes_when_through(problem: Problem):
    folders = []
    with pytest.raises(KeyboardInterrupt), journal_of(problem.evidence, ["a"]) as journal:
        folders.append(journal.folder)
        journal.kept("one", lambda: {"x": np.arange(3.0)})
        raise KeyboardInterrupt
    with journal_of(problem.evidence, ["a"]) as journal:
        folders.append(journal.folder)
        assert np.array_equal(journal.kept("one", dict)["x"], np.arange(3.0))
    assert folders[0] == folders[1] and not folders[0].exists()
    with journal_of(problem.evidence, ["b"]) as journal:
        assert journal.folder != folders[0]


def test_a_torn_file_is_made_again(tmp_path: Path):
    journal = Journal(tmp_path)
    journal.kept("one", lambda: {"x": np.arange(300.0)})
    path = tmp_path / "one.arrays"
    path.write_bytes(path.read_bytes()[:400])
    assert np.array_equal(journal.kept("one", lambda: {"x": np.arange(300.0)})["x"], np.arange(300.0))


def test_keys_differ_where_any_part_does():
    x = np.arange(6.0)
    keys = {key_of("a", x), key_of("b", x), key_of("a", x + 1e-12), key_of("a", x.reshape(2, 3)), key_of("a", None)}
    assert len(keys) == 5


def test_ctrl_c_says_that_the_same_command_goes_on(
    problem: Problem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    kept: list[Path] = []

    def stopped(evidence: Evidence, progress: object, only: object, journal: Journal) -> None:
        journal.kept("one", lambda: {"x": np.arange(3.0)})
        kept.append(journal.folder)
        raise KeyboardInterrupt

    monkeypatch.setattr(explain, "gather", lambda *given: problem.evidence)
    monkeypatch.setattr(explain, "investigate", stopped)
    out = tmp_path / "out"
    assert main(["discrepancy", "recording", "--model", "yaw_dampers", "--out", str(out)]) == 130
    assert "the same command goes on from there" in capsys.readouterr().err
    assert not out.exists() and (kept[0] / "one.arrays").is_file()
