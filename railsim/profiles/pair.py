"""Wheel and rail profiles as a vehicle's setting: names or files, wear, gauge."""

from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from typing import Annotated, Any, Literal

import pydantic

from railsim.contact.functions import ContactFunctions
from railsim.contact.pairs import WheelRailPair, upright_rails, with_upright_rails
from railsim.errors import InputError
from railsim.profiles.files import Units, read_profile, shipped_profiles
from railsim.profiles.layout import Layout
from railsim.profiles.orientation import GaugeSide
from railsim.profiles.profile import Kind, Profile
from railsim.profiles.tables import contact_functions
from railsim.profiles.wear import worn
from railsim.profiles.zones import two_contacts
from railsim.spec import Spec, quantity

SHIPPED = "shipped profile (s1002, uic60_40, ...) or the path of a file"


class ProfilePair(Spec, frozen=True):
    """Contact geometry from profiles, the same for all wheelsets; left and right may differ."""

    kind: Literal["profiles"]
    wheel: str = quantity("s1002", unit="name or path", source=SHIPPED)
    rail: str = quantity("uic60_40", unit="name or path", source=SHIPPED)
    right_wheel: str | None = quantity(None, unit="name or path", source="as the left one if not given")
    right_rail: str | None = quantity(None, unit="name or path", source="as the left one if not given")
    wear: float = quantity(0.0, unit="-", source="severity of `railsim.profiles.wear`", ge=0.0, le=1.0)
    units: Units | None = quantity(None, unit="of the files' lengths", source="as the file states, else mm")
    gauge_side: GaugeSide | None = quantity(
        None, unit="sign of y on the gauge side of the rails' files", source="the side that is there, else negative"
    )
    smoothing: float = quantity(0.0, unit="m, rms", source="0; some 5e-5 for measured profiles", ge=0.0, le=1e-3)
    gauge: float = quantity(1.435, unit="m", source="standard gauge", gt=0.5, lt=2.0)
    flange_back: float = quantity(1.360, unit="m", source="EN 13260, S1002 wheelsets: 1360 mm", gt=0.5, lt=2.0)
    upright_rails: float = upright_rails()
    wheel_load: float = quantity(55e3, unit="N", source="nominal, for the quasi-elastic averaging", gt=0.0)

    contacts: int = quantity(
        1, unit="-", source="1 = one contact a wheel, moving over the profile; 2 = tread and flange at once", ge=1, le=2
    )

    def assumptions(self) -> list[str]:
        """What was taken for granted about the files, each in a line; of files that cannot be read, nothing.

        Those are refused where a model is made of them; a recording may name profiles that are elsewhere.
        """
        texts: list[str] = []
        for name, kind in self._sources():
            if name is not None:
                with suppress(InputError):
                    texts += _read(self, name, kind).assumptions
        return list(dict.fromkeys(texts))

    def _sources(self) -> list[tuple[str | None, Kind]]:
        return [(self.wheel, "wheel"), (self.rail, "rail"), (self.right_wheel, "wheel"), (self.right_rail, "rail")]

    def sides(self, wheel_radius: float, half_gauge: float) -> tuple[ContactFunctions, ContactFunctions | None]:
        """Contact functions of the left side, and of the right one where it differs.

        The profiles themselves tell where they touch; `half_gauge` is not used.
        """
        del half_gauge
        searched = self.but(upright_rails=0.0)
        left = with_upright_rails(_functions(searched, self.wheel, self.rail, wheel_radius), self.upright_rails)
        if self.right_wheel is None and self.right_rail is None:
            return left, None
        right = _functions(searched, self.right_wheel or self.wheel, self.right_rail or self.rail, wheel_radius)
        return left, with_upright_rails(right, self.upright_rails)


def _read(pair: ProfilePair, source: str, kind: Kind) -> Profile:
    """A profile; what the pair states of files does not concern shipped ones."""
    if source in shipped_profiles():
        return read_profile(source, kind)
    return read_profile(source, kind, pair.units, pair.gauge_side if kind == "rail" else None)


@lru_cache(maxsize=32)
def _functions(pair: ProfilePair, wheel: str, rail: str, wheel_radius: float) -> ContactFunctions:
    profiles = [_read(pair, wheel, "wheel"), _read(pair, rail, "rail")]
    if pair.smoothing > 0.0:
        profiles = [profile.smoothed(pair.smoothing) for profile in profiles]
    layout = Layout(gauge=pair.gauge, flange_back=pair.flange_back, wheel_radius=wheel_radius)
    made = contact_functions if pair.contacts == 1 else two_contacts
    return made(worn(profiles[0], pair.wear), profiles[1], layout, load=pair.wheel_load)


def _chosen(given: Any) -> Any:
    """A mapping becomes the kind of pair that it names; without a kind it is an analytic one."""
    if not isinstance(given, Mapping):
        return given
    return (ProfilePair if given.get("kind") == "profiles" else WheelRailPair).build(dict(given))


Pair = Annotated[WheelRailPair | ProfilePair, pydantic.BeforeValidator(_chosen)]
