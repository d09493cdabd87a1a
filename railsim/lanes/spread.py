"""From the array of all lanes to the rows of each run (compiled)."""

from railsim.compiled import kernel
from railsim.lanes.memory import store_at


@kernel
def spread(block, kept, places, watched, limit, bad):
    """Write channels `kept` of a block (rows, channels x lanes) into the rows of each lane's run, (length, kept) at an
    address.

    places (lanes, 3): address, first row there, rows that are taken. bad (lanes,) becomes true where a number is not
    finite, or the size of a watched channel, of those kept, is beyond `limit`.
    """
    lanes, channels = places.shape[0], kept.shape[0]
    for row in range(block.shape[0]):
        for k in range(lanes):
            if row >= places[k, 2]:
                continue
            at = (places[k, 1] + row) * channels
            total = 0.0
            for channel in range(channels):
                value = block[row, kept[channel] * lanes + k]
                store_at(places[k, 0], at + channel, value)
                total += value
            bad[k] |= not abs(total) < 1e300
        for channel in range(channels):
            if watched[channel]:
                for k in range(lanes):
                    bad[k] |= row < places[k, 2] and abs(block[row, kept[channel] * lanes + k]) > limit
