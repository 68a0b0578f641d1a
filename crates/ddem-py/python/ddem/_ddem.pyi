"""Compiled part of ddem. Its docstrings give shapes, units and errors."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal, final

import numpy as np
import numpy.typing as npt
from typing_extensions import Unpack

from ddem._cells import Cells
from ddem._table import Histories, Table
from pathlib import Path as FoundPath

from ddem._types import Damping, Floats, History, Integers, Path, Place, Vector, When, Where

if TYPE_CHECKING:
    import pyvista as pv

__all__ = [
    "Joint",
    "Material",
    "Model",
    "Simulation",
    "__version__",
    "_near",
    "load",
    "run_deck",
    "schema",
]

__version__: str

@final
class Material:
    def __new__(
        cls,
        *,
        # keys: Material
        density: float,
        young: float,
        poisson: float,
        # end
        name: str | None = None,
    ) -> Material: ...
    @property
    def name(self) -> str | None: ...
    # attributes: Material
    density: Final[float]
    young: Final[float]
    poisson: Final[float]
    # end
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __dir__(self) -> list[str]: ...
    def __getnewargs_ex__(self) -> tuple[tuple[()], dict[str, Any]]: ...

@final
class Joint:
    def __new__(
        cls,
        *,
        # keys: Joint
        thickness: float = 0.0,
        material: str | Material | None = None,
        density: float | None = None,
        young: float | None = None,
        poisson: float | None = None,
        normal_stiffness: float | None = None,
        shear_stiffness: float | None = None,
        cohesion: float | None = None,
        friction: float | None = None,
        tension: float | None = None,
        residual_cohesion: float | None = None,
        residual_friction: float | None = None,
        dilation: float | None = None,
        fracture_energy: Vector | None = None,
        jrc: float | None = None,
        jcs: float | None = None,
        # end
        name: str | None = None,
    ) -> Joint: ...
    @property
    def name(self) -> str | None: ...
    # attributes: Joint
    thickness: Final[float]
    material: Final[str | Material | None]
    density: Final[float | None]
    young: Final[float | None]
    poisson: Final[float | None]
    normal_stiffness: Final[float | None]
    shear_stiffness: Final[float | None]
    cohesion: Final[float | None]
    friction: Final[float | None]
    tension: Final[float | None]
    residual_cohesion: Final[float | None]
    residual_friction: Final[float | None]
    dilation: Final[float | None]
    fracture_energy: Final[list[float] | None]
    jrc: Final[float | None]
    jcs: Final[float | None]
    # end
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __dir__(self) -> list[str]: ...
    def __getnewargs_ex__(self) -> tuple[tuple[()], dict[str, Any]]: ...

@final
class Model:
    def __new__(
        cls,
        *,
        # keys: Deck
        title: str = "",
        # end
        # keys: ModelTable
        contact: bool | None = None,
        gravity: Vector = ...,
        kinematics: Literal["small", "corotational"] = "corotational",
        element: Literal["standard", "incompatible"] = "incompatible",
        peaks: bool = False,
        # end
    ) -> Model: ...
    def add_blocks(
        self,
        *,
        # keys: BlockSet
        name: str | None = None,
        origin: Vector = ...,
        size: Vector | None = None,
        count: Sequence[int] | None = None,
        mesh: Mapping[str, Any] | None = None,
        edges: Mapping[str, Vector] | None = None,
        divisions: int = 4,
        material: str | Material,
        joint: str | Joint | Mapping[str, str | Joint] | None = None,
        body: Literal["deformable", "rigid"] = "deformable",
        axes: Sequence[Vector] | None = None,
        dip: float | None = None,
        dip_direction: float | None = None,
        planes: Mapping[str, Mapping[str, float]] | None = None,
        # end
    ) -> None: ...
    def add_region(
        self,
        *,
        # keys: RockRegion
        name: str | None = None,
        box: Mapping[str, Any] | Sequence[Vector] | None = None,
        prism: Mapping[str, Any] | None = None,
        faces: Sequence[Sequence[Vector]] | None = None,
        file: str | None = None,
        joint: str | Joint | None = None,
        join: bool = False,
        material: str | Material,
        divisions: int = 2,
        body: Literal["deformable", "rigid"] = "deformable",
        north: Vector = ...,
        seed: int = 0,
        small: Mapping[str, Any] = ...,
        # end
    ) -> None: ...
    def cut(
        self,
        *,
        # keys: RockCut
        name: str | None = None,
        set: Mapping[str, Any] | None = None,
        plane: Mapping[str, Any] | None = None,
        disc: Mapping[str, Any] | None = None,
        polygon: Sequence[Vector] | None = None,
        dfn: Mapping[str, Any] | None = None,
        surface: Path | None = None,
        tolerance: float | None = None,
        tunnel: Mapping[str, Any] | None = None,
        voronoi: Mapping[str, Any] | None = None,
        joint: str | Joint | None = None,
        join: bool = False,
        bridge: str | Joint | None = None,
        # end
        **where: Unpack[Place],
    ) -> None: ...
    def join(
        self,
        # keys: Join
        # end
        **where: Unpack[Where],
    ) -> None: ...
    def contact(
        self,
        *,
        # keys: ContactTable
        normal_stiffness: float | None = None,
        shear_stiffness: float | None = None,
        friction: float | None = None,
        damping: float | None = None,
        restitution: float | None = None,
        # end
    ) -> None: ...
    def lint(
        self,
        *,
        # keys: LintTable
        allow: Sequence[str] = ...,
        # end
    ) -> None: ...
    def output(
        self,
        *,
        # keys: OutputTable
        checkpoint_every: float | None = None,
        # end
    ) -> None: ...
    def assign(
        self,
        *,
        # keys: Assign
        joint: str | Joint | None = None,
        material: str | Material | None = None,
        # end
        **where: Unpack[When],
    ) -> None: ...
    def remove(
        self,
        *,
        # keys: Remove
        release: float | None = None,
        # end
        **where: Unpack[When],
    ) -> None: ...
    def refine(
        self,
        *,
        # keys: Refine
        factor: int,
        # end
        **where: Unpack[Where],
    ) -> None: ...
    def fix(
        self,
        axes: str,
        *,
        # keys: Fix but axes
        velocity: Vector | None = None,
        displacement: Vector | None = None,
        history: History | None = None,
        # end
        **where: Unpack[When],
    ) -> None: ...
    def load(
        self,
        *,
        # keys: Load
        traction: Vector | None = None,
        pressure: float | None = None,
        line: Vector | None = None,
        force: Vector | None = None,
        history: History | None = None,
        # end
        **where: Unpack[When],
    ) -> None: ...
    def charge(
        self,
        *,
        # keys: Charge
        mass: float | None = None,
        explosive: str | Mapping[str, float] | None = None,
        pressure: float | None = None,
        gamma: float | None = None,
        history: Literal["gas"] | History | None = None,
        delay: float | None = None,
        # end
        **where: Unpack[When],
    ) -> None: ...
    def boundary(
        self,
        kind: Literal["viscous", "free-field"],
        *,
        # keys: Boundary but kind
        velocity: Vector | None = None,
        history: History | None = None,
        # end
        **where: Unpack[When],
    ) -> None: ...
    def initial(
        self,
        *,
        # keys: Initial
        velocity: Vector | None = None,
        spin: Vector | None = None,
        centre: Vector | None = None,
        stress: Vector | None = None,
        gradient: Mapping[str, Vector] | None = None,
        # end
        **where: Unpack[Where],
    ) -> None: ...
    def stage(
        self,
        name: str,
        *,
        # keys: Stage but name
        kind: Literal["relax", "dynamic", "safety"],
        bracket: Vector | None = None,
        resolution: float | None = None,
        joints: Sequence[str] | None = None,
        limit: float | None = None,
        tolerance: float | None = None,
        max_steps: int | None = None,
        increments: int | None = None,
        on_failure: Literal["stop", "continue"] | None = None,
        duration: float | None = None,
        damping: Damping | None = None,
        time_step: float | Literal["auto"] | None = None,
        until_rest: bool | None = None,
        fields_every: float | None = None,
        frames: int | None = None,
        # end
    ) -> None: ...
    def probe(
        self,
        name: str,
        *,
        # keys: Probe but name
        at: Vector | None = None,
        quantity: Literal["displacement", "velocity", "stress", "reaction", "fragment", "peak_velocity", "peak_tension", "peak_compression"] = "displacement",
        every: float | None = None,
        every_steps: int | None = None,
        # end
        **where: Unpack[Where],
    ) -> None: ...
    def blocks(self) -> Table: ...
    def cells(self) -> Cells: ...
    def build(self, *, threads: int | None = None) -> Simulation: ...
    @staticmethod
    def from_deck(deck: Path | Mapping[str, Any]) -> Model: ...
    def to_deck(self, path: Path | None = None) -> str: ...
    @property
    def deck(self) -> dict[str, Any]: ...

@final
class Simulation:
    def relax(
        self,
        *,
        # keys: Stage relax
        tolerance: float | None = None,
        max_steps: int | None = None,
        increments: int | None = None,
        on_failure: Literal["stop", "continue"] | None = None,
        # end
        name: str | None = None,
        record: Path | None = None,
        quiet: bool = False,
    ) -> int: ...
    def run(
        self,
        duration: float,
        *,
        # keys: Stage dynamic but duration
        on_failure: Literal["stop", "continue"] | None = None,
        damping: Damping | None = None,
        time_step: float | Literal["auto"] | None = None,
        until_rest: bool | None = None,
        fields_every: float | None = None,
        frames: int | None = None,
        # end
        until: Callable[[Simulation], object] | None = None,
        every: float | None = None,
        callback: Callable[[Simulation], object] | None = None,
        name: str | None = None,
        record: Path | None = None,
        quiet: bool = False,
    ) -> int: ...
    def _waiting(self) -> str | None: ...
    def _undecided(self, steps: int) -> str | None: ...
    def _factor_of_safety(
        self, **keys: Any
    ) -> tuple[
        float | None,
        list[float | None],
        list[tuple[float, str, int]],
        list[tuple[str, int]],
        list[str],
    ]: ...
    def step(self, n: int = 1, *, quiet: bool = False) -> None: ...
    def start(
        self,
        *,
        # keys: Stage dynamic only damping time_step
        damping: Damping | None = None,
        time_step: float | Literal["auto"] | None = None,
        # end
    ) -> None: ...
    def enter(self, stage: str) -> None: ...
    def apply_force(self, nodes: npt.ArrayLike, force: npt.ArrayLike) -> None: ...
    def save(self, path: Path) -> None: ...
    def field(
        self, name: str, *, nodes: npt.ArrayLike | None = None, out: npt.NDArray[Any] | None = None
    ) -> npt.NDArray[Any]: ...
    displacement: Floats
    velocity: Floats
    @property
    def force(self) -> Floats: ...
    @property
    def stress(self) -> Floats: ...
    @property
    def peak_velocity(self) -> Floats: ...
    @property
    def peak_tension(self) -> Floats: ...
    @property
    def peak_compression(self) -> Floats: ...
    @property
    def points(self) -> Floats: ...
    @property
    def mass(self) -> Floats: ...
    @property
    def node_block(self) -> Integers: ...
    @property
    def elements(self) -> Integers: ...
    @property
    def element_block(self) -> Integers: ...
    @property
    def element_material(self) -> Integers: ...
    @property
    def element_rigid(self) -> npt.NDArray[np.bool_]: ...
    @property
    def _fields(self) -> list[list[str]]: ...
    def mesh(
        self, part: Literal["blocks", "joints", "contacts"] = "blocks"
    ) -> pv.UnstructuredGrid: ...
    @property
    def pairs(self) -> Table: ...
    @property
    def quads(self) -> Integers: ...
    @property
    def contacts(self) -> Table: ...
    @property
    def fragments(self) -> Table: ...
    @property
    def block_fragment(self) -> Integers: ...
    @property
    def momentum(self) -> Floats: ...
    @property
    def angular_momentum(self) -> Floats: ...
    def nodes(self, **where: Unpack[Where]) -> Integers: ...
    def nearest_node(self, at: Vector) -> int: ...
    def reaction(self, nodes: npt.ArrayLike) -> Floats: ...
    @property
    def probes(self) -> Histories: ...
    @property
    def title(self) -> str: ...
    @property
    def n_nodes(self) -> int: ...
    @property
    def n_blocks(self) -> int: ...
    @property
    def n_elements(self) -> int: ...
    @property
    def n_pairs(self) -> int: ...
    @property
    def time(self) -> float: ...
    @property
    def steps(self) -> int: ...
    @property
    def time_step(self) -> float: ...
    @property
    def critical_step(self) -> float: ...
    @property
    def unbalanced(self) -> float: ...
    @property
    def energy(self) -> dict[str, float]: ...
    @property
    def summary(self) -> dict[str, Any]: ...

def load(path: Path, *, model: Model | None = None, threads: int | None = None) -> Simulation: ...
def run_deck(
    deck: Path | Mapping[str, Any] | Model,
    *,
    out: Path | None = None,
    threads: int | None = None,
    resume: bool = False,
    overwrite: bool = False,
    quiet: bool = False,
    profile: bool = False,
    checkpoint_every: float | None = None,
) -> Simulation: ...
def _near(path: Path) -> FoundPath | None: ...
def schema() -> dict[str, Any]: ...
