"""Factors of safety by strength reduction."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

from ._ddem import Model, Simulation
from ._errors import NotConverged

# Steps in which a model that stands finds its first equilibrium. One on the limit never does.
_FIRST = 20_000


@dataclass(frozen=True)
class Safety:
    """Result of :func:`factor_of_safety`.

    Attributes
    ----------
    factor : float or None
        Factor of safety; None where it is outside the bracket.
    bracket : (float or None, float or None)
        Largest factor that is stable, and smallest one that is not.
    trials : list of (float, str, int)
        Factor, verdict ("at rest", "fails", "undecided") and steps of each trial.
    moving : list of (str, int)
        Set and number of the blocks that move in the unstable trial of the smallest factor.
    """

    factor: float | None
    bracket: tuple[float | None, float | None]
    trials: list[tuple[float, str, int]]
    moving: list[tuple[str, int]]


def factor_of_safety(
    model: Model | Simulation,
    *,
    bracket: tuple[float, float] | None = None,
    resolution: float | None = None,
    joints: str | Sequence[str] | None = None,
    limit: float | None = None,
    tolerance: float | None = None,
    max_steps: int | None = None,
) -> Safety:
    """Factor by which the strengths of joints can be divided until blocks move.

    Parameters
    ----------
    model : Model or Simulation
        A simulation, which stays as it is: every trial starts from its present state, which should
        be an equilibrium. Trials from another state relax what is out of balance as well, with
        strengths that are divided already. Or a model: it is relaxed first, and where it does not
        stand with its own strengths trials start from the model as built.
    bracket : (float, float), optional
        Factors between which it is looked for; (0.5, 4) without it.
    resolution : float, optional
        Width of the bracket that is left; 0.005 without it.
    joints : str or sequence of str, optional
        Names of the joints whose strengths are divided; without it all, and the friction of contacts.
    limit : float, optional
        Motion of neighbours that counts as failure where it goes on, as a part of an edge; 0.02 without it.
    tolerance : float, optional
        Unbalanced force ratio at which a trial is at rest; 1e-5 without it.
    max_steps : int, optional
        Steps after which a trial is undecided, and counts as unstable; 200 000 without it. The
        first relaxation of a model takes 20 000 at most.

    Returns
    -------
    Safety
        The factor, the bracket, the trials and the blocks that move.

    Raises
    ------
    Diverged
        Forces are not finite any more.
    ModelError
        An argument is wrong.
    KeyboardInterrupt
        The simulation is as it was.
    """
    simulation = _settled(model, max_steps) if isinstance(model, Model) else model
    keys = {
        "bracket": bracket,
        "resolution": resolution,
        "joints": [joints] if isinstance(joints, str) else joints,
        "limit": limit,
        "tolerance": tolerance,
        "max_steps": max_steps,
    }
    given = {key: value for key, value in keys.items() if value is not None}
    factor, found, trials, moving = simulation._factor_of_safety(**given)
    return Safety(factor, (found[0], found[1]), trials, moving)


def _settled(model: Model, max_steps: int | None) -> Simulation:
    """The model in equilibrium; as built where it finds none, so that factors below 1 are found."""
    simulation = model.build()
    try:
        simulation.relax(max_steps=min(_FIRST, max_steps or _FIRST), quiet=True)
    except NotConverged:
        with warnings.catch_warnings():
            # They have been given once.
            warnings.simplefilter("ignore")
            return model.build()
    return simulation
