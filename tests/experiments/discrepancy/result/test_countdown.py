"""Progress says the stage, the time gone and what is left, as long as the last run took."""

from pathlib import Path

from experiments.discrepancy.result.countdown import Countdown

RUN = (
    (1.0, "registered: start at 25.00 m, speed scale 1.0000"),
    (11.0, "fitted nuisances: cost 900"),
    (13.0, "signatures of the nominal scenario: payload (1 of 4)"),
    (16.0, "signatures of the nominal scenario: soft_track (4 of 4)"),
    (17.0, "fitted weak_yaw_damper: cost 700"),
    (30.0, "fitted nuisances: cost 800"),
    (40.0, "last run by the exudyn engine"),
)


def _said(folder: Path, duration: float, pace: float) -> list[str]:
    now, lines = [0.0], []
    countdown = Countdown(duration, lambda: now[0], lines.append, folder)
    for at, text in RUN:
        now[0] = pace * at
        countdown(text)
    now[0] = pace * 42.0
    countdown.finish()
    return lines


def test_time_left_comes_from_the_last_run_and_from_counts(tmp_path: Path):
    first, second = _said(tmp_path, 24.0, 1.0), _said(tmp_path, 48.0, 2.0)
    assert "left" not in first[0] and "left" in second[0]
    assert "about 1 s left" in first[3]  # three of four took 3 s
    assert "5/7 fits" in first[5]  # nuisances are fitted again: no step back
    assert "about 82 s left" in second[0]  # a recording twice as long: 84 s in all, 2 s gone
    assert second[-1].startswith("  80.0 s  7/7 last run, about 4 s left")
