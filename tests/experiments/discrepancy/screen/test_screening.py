"""What nuisances can take is no evidence for an effect; what they cannot take counts in full."""

import numpy as np
import pytest

from experiments.discrepancy.fit.candidates import Context, candidates
from experiments.discrepancy.fit.fitting import Fit
from experiments.discrepancy.fit.products import WEIGHT
from experiments.discrepancy.fit.scores import TOLERATED
from experiments.discrepancy.screen.projection import RANGE, Judgement, Projection
from experiments.discrepancy.screen.screening import scaled


def _fit(jacobian: np.ndarray, residual: np.ndarray, z: np.ndarray | None = None) -> Fit:
    z = np.zeros(len(jacobian)) if z is None else z
    return Fit(z, (), np.zeros(0), (), residual, residual, jacobian, jacobian)


def _judged(projection: Projection, *rows: np.ndarray) -> tuple[int, Judgement]:
    """The best of some signatures and which it is."""
    found = projection.judge_each(np.stack(rows).astype(float), [RANGE[0]] * len(rows))
    best = int(np.argmax([one.gain for one in found]))
    return best, found[best]


def test_a_signature_along_a_nuisance_is_worth_no_more_than_its_prior():
    """However strong the data: moving a nuisance by z costs z^2 / 2 nats, so the effect cannot gain more."""
    rng = np.random.default_rng(6)
    column = 50.0 * rng.standard_normal((1, 8, 5, 2))
    frames = np.arange(8) < 6
    projection = Projection(_fit(column, 0.0 * column[0]), frames)
    own = (WEIGHT * 0.4 * column[0][frames]).ravel()
    power = float(projection.cleaned(own) @ own)
    assert 0.95 * 0.4**2 < power <= 1.01 * 0.4**2


def test_a_signature_across_all_nuisances_keeps_its_power_and_is_worth_it():
    column = np.zeros((1, 4, 3, 2))
    column[..., 0] = 5.0
    across = np.zeros((4, 3, 2))
    across[..., 1] = 2.0
    projection = Projection(_fit(column, across), np.ones(4, bool))
    own = (WEIGHT * across).astype(np.float32).ravel()
    assert np.isclose(float(projection.cleaned(own) @ own), float(own @ own))
    which, found = _judged(projection, 0.1 * own, 0.8 * own)
    assert (which, np.round(found.scale, 3)) == (1, 1.25)
    assert np.isclose(found.gain, 0.5 * float(own @ own), rtol=1e-5)
    assert np.allclose(found.taken, own, atol=1e-5)


def test_what_two_large_nuisances_make_together_is_worth_no_more_than_their_priors():
    """The reading of a vertical accelerometer is gravity a thousand deviations above noise: its gain is a bias."""
    rng = np.random.default_rng(9)
    bias, moved = np.zeros((2, 24, 120, 4))
    bias[:, 0, 0] = 3e4
    moved[...] = rng.standard_normal((24, 120, 4))
    jacobian = np.stack([bias, bias + moved]).astype(np.float32)
    projection = Projection(_fit(jacobian, rng.standard_normal((24, 120, 4))), np.ones(24, bool))
    own = (WEIGHT * (0.3 * jacobian[0] - 0.1 * jacobian[1])).ravel()
    own_start = 0.5 * float(own @ own)
    assert own_start > 1e7
    assert abs(float(projection.cleaned(own) @ own)) < 0.2
    assert _judged(projection, own)[1].gain < 1.0


def test_signatures_are_judged_together_as_each_by_itself():
    rng = np.random.default_rng(11)
    projection = Projection(_fit(rng.standard_normal((3, 9, 4, 6)), rng.standard_normal((9, 4, 6))), np.arange(9) < 7)
    rows, least = rng.standard_normal((5, 7 * 4 * 6)), [0.3, 0.05, 0.3, 0.3, 0.05]
    for row, low, found in zip(rows, least, projection.judge_each(rows, least), strict=True):
        (alone,) = projection.judge_each(row[None], [low])
        assert np.allclose([found.gain, found.scale, found.power], [alone.gain, alone.scale, alone.power])
        assert np.allclose(found.taken, alone.taken) and np.allclose(found.move, alone.move)


def test_a_nuisance_that_stood_in_for_an_effect_comes_back_from_its_bound():
    """A nuisance at the edge of its tolerance has taken what an effect of the same direction did: the effect is worth
    the prior that is given back and what the nuisance could not take.
    """
    rng = np.random.default_rng(8)
    column = 3.0 * rng.standard_normal((1, 10, 6, 2))
    left = column[0] * 2.0  # the truth is five standard deviations of the nuisance, three of them are taken
    projection = Projection(_fit(column, left, np.array([TOLERATED])), np.ones(10, bool))
    own = (WEIGHT * 4.5 * column[0]).astype(np.float32).ravel()
    _, found = _judged(projection, own)
    taken = 0.5 * float((WEIGHT * left).ravel() @ (WEIGHT * left).ravel())
    assert found.gain > taken + 0.9 * 0.5 * TOLERATED**2
    assert -TOLERATED - 0.1 < found.move[0] < -0.9 * (TOLERATED - 0.5)


def _complex(rng: np.random.Generator, *shape: int) -> np.ndarray:
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


@pytest.mark.parametrize("shape", [(9, 4), (9, 1), (1, 4), (1, 1)])
def test_turned_signatures_are_judged_by_their_products(shape: tuple[int, int]):
    """As each of them written out."""
    rng = np.random.default_rng(10)
    frames = np.arange(9) < 7
    projection = Projection(_fit(rng.standard_normal((3, 9, 4, 6)), rng.standard_normal((9, 4, 6))), frames)
    signature, factors = _complex(rng, 9, 4, 3), _complex(rng, 5, *shape)
    _same(projection, projection.judge_turned(signature, factors), [signature * one[..., None] for one in factors])


def test_signatures_some_rows_later_are_judged_by_their_products():
    """As each of them written out: whole samples later by a phase, rows between by the part that is that of the row."""
    rng = np.random.default_rng(10)
    frames = np.arange(9) < 7
    projection = Projection(_fit(rng.standard_normal((3, 9, 4, 6)), rng.standard_normal((9, 4, 6))), frames)
    parts, rows, turn = _complex(rng, 2, 9, 4, 3), rng.integers(-3, 8, (5, 9)), 0.7 * np.arange(4)
    later = [parts[at % 2, np.arange(9)] * np.exp(-1j * np.outer(at // 2, turn))[..., None] for at in rows]
    _same(projection, projection.judge_later(parts, rows, turn), later)


def _same(projection: Projection, found: Judgement, written: list[np.ndarray]) -> None:
    which, judged = _judged(projection, *(projection.row(one) for one in written))
    assert found.which == which
    assert np.allclose([found.gain, found.scale, found.power], [judged.gain, judged.scale, judged.power])
    assert np.allclose(found.taken, judged.taken)
    assert found.signature is not None and np.allclose(found.signature, written[found.which])


def test_sizes_are_scaled_by_what_is_measured():
    """A flat's dip has an area that grows with the cube of its length (Newton and Clark 1979)."""
    context = Context((), (0.0, 300.0), (0.0, 10.0), ((150.0, 5.0),))
    found = {one.name: one for one in candidates(context)}
    flat = scaled(found["wheel_flat"], {"length": 0.04, "angle": 1.0}, 0.125)
    assert np.isclose(flat["length"], 0.02) and flat["angle"] == 1.0
    load = scaled(found["crosswind"], {"force": 4000.0}, 0.5)
    assert np.isclose(load["force"], 2000.0)
