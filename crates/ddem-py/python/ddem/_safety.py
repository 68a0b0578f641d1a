"""Factors of safety by strength reduction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ._ddem import Model, Simulation


@dataclass(frozen=True)
class Safety:
    """What :func:`factor_of_safety` has found.

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
    joints: Sequence[str] | None = None,
    limit: float | None = None,
    tolerance: float | None = None,
    max_steps: int | None = None,
) -> Safety:
    """Factor by which the strengths of joints can be divided until blocks move.

    Parameters
    ----------
    model : Model or Simulation
        A simulation in equilibrium, which stays as it is; or a model, which is relaxed first.
    bracket : (float, float), optional
        Factors between which it is looked for; (0.5, 4) without it.
    resolution : float, optional
        Width of the bracket that is left; 0.005 without it.
    joints : sequence of str, optional
        Names of the joints whose strengths are divided; without it all, and the friction of contacts.
    limit : float, optional
        Motion of neighbours that counts as failure where it goes on, as a part of an edge; 0.02 without it.
    tolerance : float, optional
        Unbalanced force ratio at which a trial is at rest; 1e-5 without it.
    max_steps : int, optional
        After which a trial is undecided, and counts as unstable; 200 000 without it.

    Returns
    -------
    Safety
        The factor, the bracket, the trials and the blocks that move.

    Raises
    ------
    Collapsed
        The model does not hold with its own strengths.
    ModelError
        An argument is wrong.
    KeyboardInterrupt
        The simulation is as it was.
    """
    if isinstance(model, Model):
        simulation = model.build()
        simulation.relax(quiet=True)
    else:
        simulation = model
    keys = {
        "bracket": bracket,
        "resolution": resolution,
        "joints": None if joints is None else list(joints),
        "limit": limit,
        "tolerance": tolerance,
        "max_steps": max_steps,
    }
    given = {key: value for key, value in keys.items() if value is not None}
    factor, found, trials, moving = simulation._factor_of_safety(**given)
    return Safety(factor, (found[0], found[1]), trials, moving)
