"""From the array of all lanes to the channels of each run (compiled)."""

from railsim.compiled import kernel
from railsim.lanes.memory import store_at

STRIP = 16  # rows that are turned at a time, so that what is read stays in the nearest cache


@kernel
def spread(block, places, watched, limit, bad):
    """Write a block (rows, channels x lanes) into the channels of each lane's run, (channels, length) at an address.

    places (lanes, 4): address, length, first row there, rows that are taken. bad (lanes,) becomes true where a number
    is not finite, or a watched channel's size is beyond `limit`.
    """
    lanes, channels = places.shape[0], watched.shape[0]
    for first in range(0, block.shape[0], STRIP):
        for channel in range(channels):
            most = limit if watched[channel] else 1e300
            for k in range(lanes):
                at = channel * places[k, 1] + places[k, 2]
                wrong = False
                for row in range(first, min(first + STRIP, places[k, 3])):
                    value = block[row, channel * lanes + k]
                    store_at(places[k, 0], at + row, value)
                    wrong |= not abs(value) <= most
                bad[k] |= wrong
