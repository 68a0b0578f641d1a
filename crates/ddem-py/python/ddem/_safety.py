"""Factors of safety by strength reduction."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

from ._ddem import Model, Simulation
from ._errors import Collapsed, NotConverged
from ._types import Vector

# Most steps of the first relaxation. A stable model needs fewer; a model at its limit finds no equilibrium.
_FIRST = 20_000


@dataclass(frozen=True)
class Safety:
    """Result of :func:`factor_of_safety`.

    Attributes
    ----------
    factor : float or None
        Factor of safety; None if an end of `bracket` is None, as for a factor outside the search.
    bracket : (float or None, float or None)
        Largest stable factor and smallest unstable factor; None if no trial gave one.
    trials : list of (float, str, int)
        Factor, verdict ("at rest", "fails", "undecided") and steps of each trial.
    moving : list of (str, int)
        Set and number of the moving blocks in the unstable trial with the smallest factor.
    """

    factor: float | None
    bracket: tuple[float | None, float | None]
    trials: list[tuple[float, str, int]]
    moving: list[tuple[str, int]]


def factor_of_safety(
    model: Model | Simulation,
    *,
    # keys: Stage safety but joints
    bracket: Vector | None = None,
    resolution: float | None = None,
    limit: float | None = None,
    tolerance: float | None = None,
    max_steps: int | None = None,
    # end
    joints: str | Sequence[str] | None = None,
    threads: int | None = None,
) -> Safety:
    """Factor of safety: divisor of the strengths of joints at which blocks begin to move.

    An undecided trial counts as unstable.

    Parameters
    ----------
    model : Model or Simulation
        Simulation or model to examine. The search starts from the present state of a simulation
        and does not change it. This state should be an equilibrium: otherwise the trials also
        relax the unbalanced forces, with strengths that are already reduced. A model is relaxed
        first, in at most 20 000 steps. If it finds no equilibrium with its own strengths, the search
        starts from the model as built.
    bracket : (float, float), optional
        Smallest and largest factor of the search; default `[0.5, 4.0]`.
    resolution : float, optional
        Width of the final bracket; default 0.005.
    joints : str or list of str, optional
        Names of the joints whose strengths are divided; default all, and the friction of contacts.
    limit : float, optional
        Continuing motion between neighbours that counts as failure, relative to an edge; default 0.02.
    tolerance : float, optional
        Unbalanced force ratio at which a trial is done, in (0, 1); default 1e-5.
    max_steps : int, optional
        Number of steps after which a trial is undecided; default 200 000.
    threads : int, optional
        Number of threads for a model, as in :meth:`Model.build`; a simulation has its own threads.

    Returns
    -------
    Safety
        The factor, the bracket, the trials and the blocks that move.

    Raises
    ------
    Diverged
        Forces are no longer finite.
    ModelError
        An argument is wrong.
    KeyboardInterrupt
        Ctrl-C was pressed. The simulation is unchanged.

    Warns
    -----
    UserWarning
        If the factor is outside of `bracket` or uncertain, if the first relaxation of a model
        neither reaches equilibrium nor fails, or if supports, loads, excavations or joints of a
        model wait for a stage and are not part of its factor. :meth:`Model.lint` silences these
        warnings.
    """
    if isinstance(model, Model):
        simulation = _settled(model, max_steps, threads)
    elif not isinstance(model, Simulation):
        raise TypeError(f"expected a Model or a Simulation, found {type(model).__name__!r}")
    elif threads is not None:
        raise TypeError("threads: only for a model; a simulation keeps the threads it was built with")
    else:
        simulation = model
    keys = {
        "bracket": bracket,
        "resolution": resolution,
        "joints": [joints] if isinstance(joints, str) else joints,
        "limit": limit,
        "tolerance": tolerance,
        "max_steps": max_steps,
    }
    given = {key: value for key, value in keys.items() if value is not None}
    factor, found, trials, moving, messages = simulation._factor_of_safety(**given)
    for message in messages:
        warnings.warn(message, stacklevel=2)
    return Safety(factor, (found[0], found[1]), trials, moving)


def _settled(model: Model, max_steps: int | None, threads: int | None) -> Simulation:
    """Simulation of the model in equilibrium, or as built if there is none, for factors below 1."""
    simulation = model.build(threads=threads)
    message = simulation._waiting()
    if message is not None:
        warnings.warn(message, stacklevel=3)
    steps = min(_FIRST, max_steps or _FIRST)
    try:
        simulation.relax(max_steps=steps, quiet=True)
    except NotConverged as error:
        if not isinstance(error, Collapsed):
            message = simulation._undecided(steps)
            if message is not None:
                warnings.warn(message, stacklevel=3)
        with warnings.catch_warnings():
            # The first `build` has issued these warnings.
            warnings.simplefilter("ignore")
            return model.build(threads=threads)
    return simulation
