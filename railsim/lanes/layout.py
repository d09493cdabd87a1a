"""Where everything stands in the array of a set of lanes: row by row, a number of each lane beside the next one's."""

from collections.abc import Hashable
from dataclasses import dataclass, field

ALIGNED = 64  # bytes


@dataclass
class Layout:
    """Rows by name, in the order in which they were asked for; `lanes` numbers each."""

    lanes: int
    rows: dict[Hashable, int] = field(default_factory=dict)
    size: int = 0

    def block(self, *names: Hashable) -> int:
        """First of new rows with these names, one after the other."""
        first = self.size
        for name in names:
            if name in self.rows:
                raise ValueError(f"row {name} appears twice")
            self.rows[name] = self.size
            self.size += 1
        return first

    def row(self, name: Hashable) -> int:
        """The row of that name; a new one where there is none."""
        if name not in self.rows:
            self.block(name)
        return self.rows[name]

    def text(self, name: Hashable) -> str:
        """The number of lane k in a row, as source."""
        return f"W[{self.row(name) * self.lanes} + k]"
