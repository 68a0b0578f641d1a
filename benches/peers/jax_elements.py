"""Steps with JAX, element by element with one matrix for all elements of a size."""

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402
from mesh import GRAVITY, Grid  # noqa: E402

VERSION = f"JAX {jax.__version__}, element by element"


class JaxElements:
    """Velocities of half steps and displacements, advanced by one compiled loop."""

    def __init__(self, grid: Grid, time_step: float, threads: int) -> None:
        # The number of threads is that of the processors that the process may use.
        free = np.repeat(~grid.held[:, None], 3, axis=1)
        scale = jnp.array(time_step * free / grid.mass[:, None])
        weight = jnp.array(free * np.array([0.0, 0.0, GRAVITY * time_step]))
        kinds = [(jnp.array(nodes), jnp.array(matrix)) for nodes, matrix in grid.kinds]

        def forces(u):
            force = jnp.zeros_like(u)
            for nodes, matrix in kinds:
                own = u[nodes].reshape(-1, 24) @ matrix
                force = force.at[nodes].add(own.reshape(-1, 8, 3))
            return force

        def advance(_, state):
            u, v, part = state
            v = v + part * (weight - scale * forces(u))
            return u + time_step * v, v, 1.0

        self.loop = jax.jit(lambda state, count: jax.lax.fori_loop(0, count, advance, state))
        nothing = jnp.zeros((grid.nodes, 3))
        # The first step is a half step of the velocities.
        self.state = (nothing, nothing, 0.5)

    def step(self, count: int) -> None:
        self.state = self.loop(self.state, count)
        jax.block_until_ready(self.state)

    def displacement(self) -> np.ndarray:
        return np.asarray(self.state[0])


PEER = JaxElements
