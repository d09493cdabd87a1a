"""A receiver's way, and how receivers and phones write it: NMEA 0183 and GPX."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import reduce
from operator import xor

import numpy as np

START = datetime(2024, 5, 3, 23, 59, 50, tzinfo=UTC)


@dataclass(frozen=True)
class Way:
    """Fixes at `time` s after `START`: degrees, m and m/s, shape (n,)."""

    time: np.ndarray
    latitude: np.ndarray
    longitude: np.ndarray
    altitude: np.ndarray
    speed: np.ndarray


def way(count: int = 40, rate: float = 1.0) -> Way:
    """Northward and westward across midnight, at about 20 m/s."""
    time = np.arange(count) / rate
    speed = 20 + np.sin(time / 9)
    return Way(time, 47.0 + time * 1.8e-4, -8.5 - time * 1e-5, 400 + time / 7, speed)


def sentence(body: str) -> str:
    """With its checksum."""
    return f"${body}*{reduce(xor, body.encode()):02X}\r\n"


def nmea(one: Way, kinds: Sequence[str] = ("GGA", "RMC", "VTG"), talker: str = "GN") -> str:
    """The sentences of each fix, one of the satellites among them."""
    lines = []
    for row in range(one.time.size):
        now = START + timedelta(seconds=float(one.time[row]))
        clock, day = now.strftime("%H%M%S.%f")[:10], now.strftime("%d%m%y")
        north, east = _angle(one.latitude[row], "NS", 2), _angle(one.longitude[row], "EW", 3)
        knots = one.speed[row] * 3600 / 1852
        bodies = {
            "GGA": f"GGA,{clock},{north},{east},1,09,0.9,{one.altitude[row]:.1f},M,47.0,M,,",
            "RMC": f"RMC,{clock},A,{north},{east},{knots:.3f},355.0,{day},,,A",
            "VTG": f"VTG,355.0,T,,M,{knots:.3f},N,{one.speed[row] * 3.6:.3f},K,A",
            "ZDA": f"ZDA,{clock},{now:%d},{now:%m},{now:%Y},00,00",
        }
        lines += [sentence(talker + bodies[kind]) for kind in kinds] + [
            sentence(f"{talker}GSA,A,3,04,05,,,,1.8,1.0,1.5")
        ]
    return "".join(lines)


def gpx(one: Way, speed: str = "<extensions><gpxtpx:speed>{:.3f}</gpxtpx:speed></extensions>") -> str:
    """A track of one segment; `speed` is how its points hold the speed."""
    head = (
        '<?xml version="1.0" encoding="UTF-8"?>\n<gpx version="1.1" creator="test" '
        'xmlns="http://www.topografix.com/GPX/1/1" xmlns:gpxtpx="http://www.garmin.com/xmlschemas/TrackPointExtension/v2">'
        "<trk><name>ride</name><trkseg>\n"
    )
    points = []
    for row in range(one.time.size):
        stamp = (START + timedelta(seconds=float(one.time[row]))).isoformat(timespec="milliseconds")
        points.append(
            f'<trkpt lat="{one.latitude[row]:.7f}" lon="{one.longitude[row]:.7f}"><ele>{one.altitude[row]:.2f}</ele>'
            f"<time>{stamp.replace('+00:00', 'Z')}</time>{speed.format(one.speed[row])}</trkpt>\n"
        )
    return head + "".join(points) + "</trkseg></trk></gpx>\n"


def _angle(value: float, sides: str, digits: int) -> str:
    whole, side = int(abs(value)), sides[0] if value >= 0 else sides[1]
    return f"{whole:0{digits}d}{60 * (abs(value) - whole):08.5f},{side}"
