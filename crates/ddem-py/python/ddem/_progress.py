"""Progress bar of a long call in terminals and notebooks, drawn by tqdm if it is installed."""

from __future__ import annotations

import sys
import warnings
from typing import Any

#: Calls shorter than this show no bar [s].
DELAY = 0.5


def _in_notebook() -> bool:
    """True in a Jupyter kernel."""
    ipython: Any = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")


class ProgressBar:
    """Progress bar: one for each stage, created at its first update."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._stage: str | None = None
        try:
            with warnings.catch_warnings():
                # Without ipywidgets tqdm warns and draws a text bar, which is sufficient.
                warnings.simplefilter("ignore")
                from tqdm.auto import tqdm
        except ImportError:
            self._make = None
        else:
            self._make = tqdm

    def update(
        self,
        stage: str,
        step: int,
        steps: int | None,
        time: float,
        unbalanced: float,
        counts: tuple[int, int],
        updates_per_second: float,
    ) -> None:
        """Show the progress of a stage; `steps` is None if the number of steps is unknown.

        `counts` has the number of failed pairs and the number of contacts between two blocks.
        """
        if self._make is None:
            return
        if stage != self._stage:
            self.close()
            # None: tqdm draws no bar if the output is not a terminal. The text bar of a notebook without
            # ipywidgets would treat the notebook as a file, so a notebook needs False.
            disable = False if _in_notebook() else None
            self._bar = self._make(
                desc=stage, unit="step", unit_scale=True, delay=DELAY, disable=disable
            )
            self._stage = stage
        bar = self._bar
        bar.total = steps
        shown = {"t": f"{time:.4g} s", "unbalanced": f"{unbalanced:.1e}"}
        for name, count in zip(("failed", "contacts"), counts):
            if count:
                shown[name] = str(count)
        shown["updates"] = f"{updates_per_second:.2e}/s"
        bar.set_postfix(shown, refresh=False)
        bar.update(step - bar.n)

    def close(self) -> None:
        """Close the bar in its present state."""
        if self._bar is not None:
            bar, self._bar, self._stage = self._bar, None, None
            bar.close()
