"""A machine, simulated here in NumPy, on a jointed pillar, simulated by ddem.

    python examples/coupling.py [folder for the picture]

The machine is a mass on a spring and a dashpot. It is placed at once and bounces until it is at
rest. At every step the loop reads the displacement of the top of the pillar, applies the force of
the machine to it, and moves the machine by the same force. Period, decay and rest position are
compared with the exact values of a jointed bar. Writes coupling.png.
"""

import sys
from pathlib import Path

import ddem
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

GRAVITY = 9.81  # m/s²
DENSITY, YOUNG = 2400.0, 18e9  # kg/m³, Pa
BLOCKS, STIFFNESS = 6, 2e10  # of 1 m each, joints in Pa/m
MASS, SPRING, DASHPOT = 20e3, 2e9, 2e6  # kg, N/m, N s/m


def pillar() -> ddem.Simulation:
    """Blocks on top of each other; with a Poisson's ratio of zero they form a bar."""
    rock = ddem.Material(density=DENSITY, young=YOUNG, poisson=0.0)
    seam = ddem.Joint(normal_stiffness=STIFFNESS, shear_stiffness=STIFFNESS)
    model = ddem.Model(title="pillar under a machine", kinematics="small")
    model.add_blocks(size=(1, 1, BLOCKS), count=(1, 1, BLOCKS), material=rock, joint=seam)
    model.fix("xyz", z=0.0)
    return model.build()


def simulate(duration: float) -> tuple[Array, Array, Array]:
    """Times [s], and displacements of the machine and of the top of the pillar [m]."""
    simulation = pillar()
    top = simulation.nodes(z=float(BLOCKS))
    share = simulation.mass[top] / simulation.mass[top].sum()  # nodal shares of the face
    simulation.start()  # undamped, 0.9 of the critical step
    step = simulation.time_step

    moved = np.empty((len(top), 3))
    force = np.zeros((len(top), 3))
    history = np.zeros((round(duration / step), 3))
    machine = speed = before = 0.0
    for row in history:
        simulation.field("displacement", nodes=top, out=moved)
        below = share @ moved[:, 2]
        row[:] = simulation.time, machine, below

        # Force on the machine, and the opposite force on the pillar. Both speeds are half a step
        # old.
        push = SPRING * (below - machine) + DASHPOT * ((below - before) / step - speed)
        force[:, 2] = -push * share
        simulation.apply_force(top, force)
        simulation.step()
        speed += step * (push / MASS - GRAVITY)
        machine += step * speed
        before = below
    print(f"{len(history)} steps of {1e6 * step:.1f} µs, a force at each")
    return history[:, 0], history[:, 1], history[:, 2]


def rest() -> float:
    """Rest position of the machine [m]: its weight on springs in series."""
    return -MASS * GRAVITY * (BLOCKS / YOUNG + (BLOCKS - 1) / STIFFNESS + 1 / SPRING)


def exact() -> complex:
    """Exponent s = -decay + i frequency of the slowest motion exp(s t)."""

    def unbalanced(s: complex) -> complex:
        # Displacement and force of a bar, transferred through blocks and joints up to the top.
        k = s / np.sqrt(YOUNG / DENSITY)
        ek = YOUNG * k
        block = np.array([[np.cosh(k), np.sinh(k) / ek], [ek * np.sinh(k), np.cosh(k)]])
        joint = np.array([[1, 1 / STIFFNESS], [0, 1]])
        u, n = block @ np.linalg.matrix_power(joint @ block, BLOCKS - 1) @ [0, 1]
        link = SPRING + DASHPOT * s
        return complex(n + u * link * MASS * s**2 / (MASS * s**2 + link))

    # Secant method, starting from the frequency of the machine on a pillar without mass.
    a = 1j * np.sqrt(GRAVITY / -rest())
    b = 1.01 * a
    while abs(b - a) > 1e-12 * abs(b):
        a, b = b, b - unbalanced(b) * (b - a) / (unbalanced(b) - unbalanced(a))
    return complex(b)


def measured(time: Array, machine: Array, period: float) -> tuple[complex, float]:
    """Exponent s of the motion exp(s t) in a history, and its rest position."""
    # Of three successive samples, the third is a linear combination of the others and a constant.
    every = round(period / 4 / time[1])
    y = machine[4 * every :]  # without the initial shaking
    first, second, third = y[: -2 * every], y[every:-every], y[2 * every :]
    terms = np.column_stack([second, first, np.ones_like(first)])
    (a, b, c), *_ = np.linalg.lstsq(terms, third, rcond=None)
    root = max(np.roots([1, -a, -b]), key=lambda r: r.imag)
    return complex(np.log(root) / (every * time[1])), float(c / (1 - a - b))


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    motion = exact()
    period = 2 * np.pi / motion.imag
    time, machine, top = simulate(15 * period)

    found, rests = measured(time, machine, period)
    print("                    exact     coupled   error")
    for what, unit, one, other, tolerance in [
        ("period", "ms", 1e3 * period, 2e3 * np.pi / found.imag, 1e-3),
        ("decay", "1/s", -motion.real, -found.real, 1e-2),
        ("rest", "mm", 1e3 * rest(), 1e3 * rests, 1e-3),
    ]:
        error = other / one - 1
        print(f"{what + f' [{unit}]':14} {one:11.5f} {other:11.5f} {100 * error:6.2f} %")
        assert abs(error) < tolerance
    draw(folder / "coupling.png", time, machine, top, motion)


def draw(file: Path, time: Array, machine: Array, top: Array, motion: complex) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 5), layout="constrained")
    axes.plot(1e3 * time, 1e3 * machine, label="machine")
    axes.plot(1e3 * time, 1e3 * top, label="top of the pillar")
    decay = rest() * np.exp(motion.real * time)
    for sign, label in [(1, "exact decay"), (-1, None)]:
        envelope = rest() + sign * decay
        axes.plot(1e3 * time, 1e3 * envelope, "k--", linewidth=1, alpha=0.5, label=label)
    axes.axhline(1e3 * rest(), color="k", linewidth=1, alpha=0.5, label="exact rest")
    axes.set(xlabel="time [ms]", ylabel="vertical displacement [mm]", xlim=(0, None))
    axes.set_title("A machine is put down on a jointed pillar")
    axes.legend(frameon=False, ncols=2)
    axes.grid(alpha=0.3)
    figure.savefig(file, dpi=120)


if __name__ == "__main__":
    main()
