"""Deformable block discrete element program for jointed rock.

Blocks are meshed with hexahedra; the joints between them have real thickness. A :class:`Model` is a
deck in memory, and :meth:`Model.build` makes a :class:`Simulation` of it.

>>> rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
>>> seam = ddem.Joint(thickness=0.01, material=rock)
>>> model = ddem.Model(gravity=(0, 0, -9.81))
>>> model.add_blocks(size=(1, 1, 2), count=(1, 1, 2), divisions=2, material=rock, joint=seam)
>>> model.fix("xyz", z=0.0)
>>> simulation = model.build()
>>> steps = simulation.relax()
>>> weight = simulation.reaction(simulation.nodes(z=0.0))[2]
>>> round(float(weight) / (2400 * 9.81 * 2), 6)
1.0
"""

from ddem._ddem import (
    Joint,
    Material,
    Model,
    Simulation,
    __version__,
    load,
    run_deck,
    schema,
)
from ddem._errors import Busy, Collapsed, Diverged, Error, ModelError, NotConverged
from ddem._animate import animate
from ddem._cells import Cells
from ddem._plot import plot
from ddem._probes import plot_probes, read_probes
from ddem._results import Frame, Results
from ddem._rock import plot_blocks
from ddem._safety import Safety, factor_of_safety
from ddem._sizes import plot_sizes, read_fragments
from ddem._stereonet import plot_stereonet

__all__ = [
    "Busy",
    "Cells",
    "Collapsed",
    "Diverged",
    "Error",
    "Frame",
    "Joint",
    "Material",
    "Model",
    "ModelError",
    "NotConverged",
    "Results",
    "Safety",
    "Simulation",
    "__version__",
    "animate",
    "factor_of_safety",
    "load",
    "plot",
    "plot_blocks",
    "plot_probes",
    "plot_sizes",
    "plot_stereonet",
    "read_fragments",
    "read_probes",
    "run_deck",
    "schema",
]
