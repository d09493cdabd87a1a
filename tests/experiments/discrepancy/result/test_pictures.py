"""The report's pictures show what a person would want, and no more."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from experiments.discrepancy.baseline.noise import Whitener
from experiments.discrepancy.result.pictures import latent, spectra
from experiments.discrepancy.screen.latent import LatentForce
from experiments.discrepancy.screen.linear import Place


def test_only_the_first_place_shows_all_of_its_states():
    curve = np.column_stack([np.linspace(-1.0, 1.0, 5), np.arange(5.0), np.ones(5)])
    joint, body, reading = (
        Place("body", "bogie", "yaw"),
        Place("bogie", "", "yaw"),
        Place("bogie.rate_yaw", "", "reading"),
    )
    forces = [
        LatentForce(place, 0.5, 90.0, np.zeros(1), np.zeros(1), state, curve, follows)
        for place in (joint, body)
        for state, follows in (("velocity [rad/s]", 0.3), ("displacement [rad]", 0.01))
    ]
    nothing = LatentForce(reading, 0.1, 50.0, np.zeros(1), np.zeros(1), "", np.zeros((0, 3)), 0.0)
    titles = [panel.get_title() for panel in latent([*forces, nothing]).axes]
    assert [title.split("\n")[0] for title in titles] == [joint.label, joint.label, body.label]
    assert titles[-1].endswith("explains 30 % of its power")


def test_the_noise_of_lost_frames_is_not_drawn():
    """Their deviation is without bound: it would push the signal out of the picture."""
    shape, lost = (4, 8, 1), 2
    deviation, measured = np.full(shape, 0.01), np.ones(shape, complex)
    deviation[lost], measured[lost] = 1e6, np.nan
    good = np.array([[True], [True], [False], [True]])
    white = Whitener(1.0 / deviation[..., None], deviation, good, np.zeros(4))
    frames, evidence = SimpleNamespace(frequencies=np.arange(8.0)), SimpleNamespace(channels=["bogie.rate_yaw [rad/s]"])
    problem: Any = SimpleNamespace(white=white, measured=measured, frames=frames, evidence=evidence)
    panel = spectra(problem, [("nominal model", np.zeros(shape))]).axes[0]
    low, high = panel.get_ylim()
    assert [low < line.get_ydata()[0] < high for line in panel.get_lines()] == [True, True]  # type: ignore[index]
    assert low < 0.01 < high
