"""The progress bar of a long call: tqdm's, in terminals and notebooks, where it is installed."""

from __future__ import annotations

import sys
import warnings
from typing import Any

#: Calls shorter than this show nothing [s].
DELAY = 0.5


def _in_notebook() -> bool:
    """True where a kernel of Jupyter runs this."""
    ipython: Any = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")


class Bar:
    """One bar for each stage, made when there is something to show."""

    def __init__(self) -> None:
        self._bar: Any = None
        self._stage: str | None = None
        try:
            with warnings.catch_warnings():
                # A bar of text does as well: nothing to warn of.
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
        """Shows where a stage is; without `steps` it is not known how many there will be.

        `counts` are those of failed pairs and of blocks in contact.
        """
        if self._make is None:
            return
        if stage != self._stage:
            self.close()
            # Nothing where the output is neither a terminal nor a notebook. One without ipywidgets
            # has a bar of text, which would take it for a file.
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
        """Leaves the bar as it is."""
        if self._bar is not None:
            bar, self._bar, self._stage = self._bar, None, None
            bar.close()
