"""The report's pictures show what a person would want, and no more."""

import numpy as np

from experiments.discrepancy.result.pictures import latent
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
    assert titles[-1].endswith("30%")
