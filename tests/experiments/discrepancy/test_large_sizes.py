"""Effects that grow otherwise than in proportion are looked for from a large size too."""

import numpy as np
import pytest

from experiments.discrepancy.railway.cases import ALL, nominal, recorded
from experiments.discrepancy.railway.library import found_library, large, starts
from experiments.discrepancy.railway.record import Record
from experiments.discrepancy.railway.scales import SCALES
from experiments.discrepancy.railway.system import Railway
from experiments.discrepancy.recording.evidence import evidence_of
from railsim.effects.interface import EFFECTS


def test_a_large_size_is_the_geometric_mean_of_the_default_and_the_bound():
    wind = EFFECTS.pick("crosswind").parameters()
    share, force = large(wind), wind["force"]
    assert share == pytest.approx(np.sqrt(force.high / force.default))
    assert share is not None
    sizes = sorted(one[0] for one in starts({"force": force}))
    assert sizes == pytest.approx([-share * force.default, -force.default, force.default, share * force.default])
    assert large(EFFECTS.pick("wheel_unbalance").parameters()) is None  # a tone, in proportion


def test_a_wind_that_lays_the_body_on_its_stops_has_two_changes():
    """A little one moves the body aside and is not seen; a large one stiffens the suspension."""
    record = Record(evidence_of(recorded(np.random.default_rng(3), "home", (), ALL), nominal("home", ALL)))
    system = Railway(record, SCALES)
    (wind,) = (one for one in found_library(system, ("crosswind",)).library.effects if one.kind == "name")
    assert wind.shown is not None
    sizes = [np.sqrt(sum(float(np.sum(np.abs(one[k]) ** 2)) for one in wind.shown)) for k in range(len(wind.shown[0]))]
    share = large(EFFECTS.pick("crosswind").parameters())
    assert len(sizes) == 2 and share is not None and sizes[1] > 1.5 * share * sizes[0]
