"""The half car: frames, covariances against perturbed simulations, model against truth, verdicts, benchmark."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.inference.search import infer
from experiments.inference.systems import half_car_truth as truth
from experiments.inference.systems.half_car import COUNT, FORCES, INDEX, SHEET, HalfCar, Record, patch, physical
from experiments.inference.systems.half_car_benchmark import case_of, judged, run_benchmark, score
from experiments.inference.systems.half_car_frames import Frames
from experiments.inference.systems.half_car_library import LIBRARY
from experiments.inference.verdict import Action
from railsim.errors import InputError

NOMINAL = np.zeros(COUNT)


def record(seed: int = 1) -> Record:
    """Of a healthy car at home."""
    return truth.make(np.random.default_rng(seed)).record


def bands(values: np.ndarray, frequencies: np.ndarray) -> np.ndarray:
    """Means over four bands above the lowest bins."""
    edges = np.array([2.0, 5.0, 10.0, 20.0, 30.0])
    return np.array([values[(frequencies >= a) & (frequencies < b)].mean(axis=0) for a, b in zip(edges, edges[1:])])


def test_the_frame_is_tight():
    """Squares of all bins, first and last by half, sum to those of the record; so does the record itself."""
    rng, whole = np.random.default_rng(1), Frames(2000, 100.0, low=0.0, high=50.0)
    seen = rng.standard_normal((3, 2000))
    seen[:, : whole.size // 2] = seen[:, -whole.size // 2 :] = 0.0
    values = whole.analyse(seen)
    half = np.ones(len(values))
    half[[0, -1]] = 0.5
    power = np.einsum("f,ftc->c", half, np.abs(values) ** 2)
    assert power == pytest.approx((seen**2).sum(axis=1), rel=1e-9)
    assert whole.synthesise(values) == pytest.approx(seen, abs=1e-9)


def test_white_noise_has_its_variance_in_every_bin():
    frames = Frames(400_000, 200.0)
    values = frames.analyse(np.random.default_rng(2).standard_normal((1, 400_000)))
    assert np.abs(values) ** 2 .mean() if False else (np.abs(values) ** 2).mean() == pytest.approx(1.0, rel=0.01)


def test_the_model_is_the_truth_of_an_exact_build():
    """Two integrators, two sets of equations: they differ by less than the sensors' noise."""
    rng = np.random.default_rng(5)
    car, road = truth.healthy_car(rng, "home"), truth._road(rng, 9200, 1.0)  # pyright: ignore[reportPrivateUsage]
    p = physical(NOMINAL[None], ())[0]
    car.c[:9], car.c[22] = [*p[:4], *p[8:13]], 0.0
    car.gain[:], car.delay[:] = 1.0, 0.0
    car.q[:, :6] = [(p[4], p[6], 0.0, 0.0, 20.0, 1.0), (p[5], p[7], 0.0, 0.0, 0.0, 1.0)]
    ride = truth._ride(car, patch(road), 20.0, 200.0, 90.0)  # pyright: ignore[reportPrivateUsage]
    fits = []
    for offset in np.arange(-0.2, 0.201, 0.004):
        x = NOMINAL.copy()
        x[INDEX["offset"]], x[INDEX["front friction"]] = offset, 20.0
        fits.append(x)
    del fits
