"""Where wheels and rails stand: gauge, flange backs, taping lines."""

from railsim.spec import Spec, quantity


class Layout(Spec, frozen=True):
    """Measures of a wheelset and its track."""

    gauge: float = quantity(1.435, unit="m", source="standard gauge", gt=0.5, lt=2.0)
    gauge_depth: float = quantity(0.014, unit="m", source="EN 13848-1: gauge within 14 mm below the top", gt=0.0)
    flange_back: float = quantity(1.360, unit="m", source="EN 13260, S1002 wheelsets: 1360 mm", gt=0.5, lt=2.0)
    taping_line: float = quantity(0.070, unit="m", source="EN 13715: 70 mm from the flange's back", gt=0.0, lt=0.2)
    wheel_radius: float = quantity(0.46, unit="m", source="Manchester benchmark: 460 mm", gt=0.1, lt=1.0)

    def half_taping(self) -> float:
        """Distance of a taping line from the middle of the wheelset [m]."""
        return 0.5 * self.flange_back + self.taping_line
