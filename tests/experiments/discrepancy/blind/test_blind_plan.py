"""Any first part of the blind cases is a fair sample; another section, speed, vehicle and line are what they say."""

from collections import Counter

from experiments.discrepancy.blind.blind_plan import EMPTY, HIDDEN, kind_of, name_of, nominal_of, setting_of


def test_shares_hold_for_any_first_part():
    """450 cases: 150 with something hidden, 300 without; of the first n a third, to within one triple."""
    kinds = [kind_of(5, number) for number in range(450)]
    counts = Counter(kinds)
    assert counts == {**{kind: 10 * n for kind, n in HIDDEN.items()}, **{kind: 10 * n for kind, n in EMPTY.items()}}
    for first in range(1, 450):
        assert abs(sum(kind in HIDDEN for kind in kinds[:first]) - first / 3.0) <= 1.0
    assert [kind_of(6, number) for number in range(45)] != kinds[:45]


def test_settings_and_effects_take_turns():
    hidden = [number for number in range(450) if kind_of(5, number) in HIDDEN]
    assert Counter(setting_of(5, number) for number in hidden) == {"home": 60, "section": 30, "speed": 30, "line": 30}
    single = [number for number in range(450) if kind_of(5, number) == "effect"]
    names = [f"effect{i}" for i in range(30)]
    assert set(Counter(name_of(5, number, names) for number in single).values()) == {3}


def test_held_out_settings_differ_from_home():
    home, section, speed, line = (nominal_of("yaw_dampers", one, 24.0) for one in ("home", "section", "speed", "line"))
    assert section.start > home.start + (home.distance or 0.0)
    assert abs((speed.distance or 0.0) - 0.8 * (home.distance or 0.0)) < 1e-6
    assert line.track != home.track and line.vehicle_name != home.vehicle_name
