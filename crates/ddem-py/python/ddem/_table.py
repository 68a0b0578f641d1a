"""Tables: structured arrays that become data frames in one call."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._names import TENSOR, VECTOR

if TYPE_CHECKING:
    import pandas as pd

# Names of the numbers in columns with several numbers per row.
_PARTS = {2: ("a", "b"), 3: VECTOR, 6: TENSOR}


def _pandas() -> Any:
    try:
        import pandas
    except ImportError as missing:
        raise ImportError("data frames need pandas: pip install pandas") from missing
    return pandas


class Table(np.recarray[Any, Any]):
    """Structured array whose columns are also attributes, and which converts to a data frame.

    It is a NumPy record array: ``pairs["slip"]``, ``pairs.slip`` and ``pairs[pairs.state > 0]``
    work as in any record array.
    """

    def to_pandas(self) -> pd.DataFrame:
        """Convert the table to a data frame with a column for each number.

        Returns
        -------
        pandas.DataFrame
            Data frame with columns such as ``force.x`` for vectors, ``stress.xx`` for stresses, and
            ``blocks.a`` and ``blocks.b`` for the numbers of two blocks or nodes, as in the CSV files
            of results.

        Raises
        ------
        ImportError
            If pandas is not installed.
        """
        pandas = _pandas()
        columns: dict[str, npt.NDArray[Any]] = {}
        for name in self.dtype.names or ():
            values = np.asarray(self[name])
            if values.ndim == 1:
                columns[name] = values
                continue
            parts = _PARTS.get(values.shape[1], tuple(map(str, range(values.shape[1]))))
            columns |= {f"{name}.{part}": values[:, at] for at, part in enumerate(parts)}
        frame: pd.DataFrame = pandas.DataFrame(columns)
        return frame


class Histories(dict[str, Table]):
    """Histories of probes: dictionary of tables by the name of the probe."""

    def to_pandas(self) -> pd.DataFrame:
        """Combine all probes in one data frame with a row for each step at which a probe was sampled.

        Returns
        -------
        pandas.DataFrame
            Data frame with ``step``, ``time`` (s) and columns such as ``top.x``; NaN where a probe was
            not sampled.

        Raises
        ------
        ImportError
            If pandas is not installed.
        """
        pandas = _pandas()
        keys = ["step", "time"]
        frame: pd.DataFrame = pandas.DataFrame({"step": np.empty(0, np.int64), "time": np.empty(0)})
        for name, history in self.items():
            own = history.to_pandas().drop_duplicates(keys, keep="last")
            own = own.rename(columns=lambda part, name=name: part if part in keys else f"{name}.{part}")
            frame = frame.merge(own, on=keys, how="outer")
        return frame.sort_values(keys, ignore_index=True)
