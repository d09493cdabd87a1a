"""Rows and columns of a section's table."""

import numpy as np
import pandas as pd


def where(table: pd.DataFrame, chosen: object) -> pd.DataFrame:
    """Rows for which `chosen`, one truth value a row, is true."""
    return pd.DataFrame(table[np.asarray(chosen, bool)])


def of(table: pd.DataFrame, column: str, value: object) -> pd.DataFrame:
    """Rows whose `column` is `value`."""
    return where(table, table[column] == value)


def values(table: pd.DataFrame, column: str) -> np.ndarray:
    """A column of numbers."""
    return np.asarray(table[column], float)
