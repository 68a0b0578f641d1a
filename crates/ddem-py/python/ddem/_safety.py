"""Factors of safety by strength reduction."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

from ._ddem import Model, Simulation
from ._errors import Collapsed, NotConverged

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
    threads: int | None = None,
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
    threads : int, optional
        Of a model, as in :meth:`Model.build`; a simulation has its own.

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
        The simulation is as it was.

    Warns
    -----
    UserWarning
        Where a trial that decides was undecided, where a model finds no equilibrium in its first
        relaxation, and where supports, loads or excavations of a model wait for a stage: they are
        no part of its factor.
    """
    if isinstance(model, Model):
        simulation = _settled(model, max_steps, threads)
    elif not isinstance(model, Simulation):
        raise TypeError(f"expected a Model or a Simulation, found {type(model).__name__!r}")
    elif threads is not None:
        raise TypeError("threads: a simulation has those that it was built with")
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
    factor, found, trials, moving = simulation._factor_of_safety(**given)
    _warn_of_undecided(found, trials)
    return Safety(factor, (found[0], found[1]), trials, moving)


def _warn_of_undecided(
    bracket: Sequence[float | None], trials: Sequence[tuple[float, str, int]]
) -> None:
    end = trials[0][0] if bracket[0] is None and bracket[1] is None else bracket[1]
    for tried, verdict, steps in trials:
        if tried == end and verdict == "undecided":
            then = "there is no factor of safety" if bracket[0] is None else "it counts as unstable"
            warnings.warn(
                f"the trial with strengths / {tried:.4f} was undecided after {steps} steps, and "
                f"{then}; raise `max_steps` [undecided-trial]",
                stacklevel=3,
            )


def _settled(model: Model, max_steps: int | None, threads: int | None) -> Simulation:
    """The model in equilibrium; as built where it finds none, so that factors below 1 are found."""
    simulation = model.build(threads=threads)
    if waiting := simulation._waiting():
        names = ", ".join(f"`{name}`" for name in waiting)
        warnings.warn(
            f"supports, loads, excavations or joints wait for the stages {names} and are no part of this factor: "
            "enter them in a simulation, or give the model a stage of kind \"safety\" and run it with run_deck "
            "[waiting-stages]",
            stacklevel=3,
        )
    steps = min(_FIRST, max_steps or _FIRST)
    try:
        simulation.relax(max_steps=steps, quiet=True)
    except NotConverged as error:
        if not isinstance(error, Collapsed):
            warnings.warn(
                f"the model is not in equilibrium after {steps} steps: trials start from it as built; "
                "give a simulation in equilibrium [not-in-equilibrium]",
                stacklevel=3,
            )
        with warnings.catch_warnings():
            # They have been given once.
            warnings.simplefilter("ignore")
            return model.build(threads=threads)
    return simulation
