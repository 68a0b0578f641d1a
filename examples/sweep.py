"""A hundred shear boxes in a pool of processes, and the joint strength recovered from them.

    python examples/sweep.py [folder for the picture]

Two blocks and one joint: the lower block is fixed, and the upper one is pressed down and driven
sideways until the joint breaks. The peaks of the shear stress over the pressure lie on a line. Its
intercept is the cohesion, and its slope is the tangent of the friction angle. Writes sweep.png.
"""

import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import ddem
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

JOINTS = [(0.5e6, 40.0), (1.0e6, 30.0), (1.5e6, 35.0), (2.0e6, 20.0)]  # cohesion (Pa), friction (°)
PRESSURES = np.linspace(0.2e6, 5e6, 25)  # Pa


def peak(box: tuple[float, float, float]) -> float:
    """Peak shear stress [Pa] of a box with a cohesion, a friction angle and a pressure."""
    cohesion, friction, pressure = box
    rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
    # A soft layer without tensile strength; after its peak only friction remains.
    seam = ddem.Joint(
        thickness=0.001,
        density=2000,
        young=5e7,
        poisson=0.25,
        cohesion=cohesion,
        friction=friction,
    )
    model = ddem.Model(title="shear box", contact=False)
    model.add_blocks(size=(1, 1, 2), count=(1, 1, 2), divisions=2, material=rock, joint=seam)
    model.fix("xyz", z=(0.0, 1.0))
    # Driven at 1 mm/s, slow enough to fail in equilibrium, and free to move vertically.
    model.fix("xy", z=(1.0, 2.0), velocity=(1e-3, 0, 0), history={"ramp": 0.02})
    model.load(pressure=pressure, z=2.0)
    model.probe("held", z=(0.0, 1.0), quantity="reaction", every=1e-5)  # less than a step

    # The processes share the cores: one thread for each box.
    simulation = model.build(threads=1)
    simulation.relax(tolerance=1e-9, quiet=True)
    # To 0.35 mm: the layer has 2e10 Pa/m, so every joint has failed by then.
    simulation.run(0.36, damping=0.02, quiet=True)
    if not simulation.pairs["state"].all():
        raise RuntimeError(f"the box {box} has not broken")
    return float(-simulation.probes["held"]["x"].min())  # N on 1 m²


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    boxes = [(c, phi, float(p)) for c, phi in JOINTS for p in PRESSURES]
    with ProcessPoolExecutor() as pool:
        peaks = np.array(list(pool.map(peak, boxes, chunksize=5))).reshape(len(JOINTS), -1)

    # τ = c + σ tan φ, by least squares.
    terms = np.column_stack([np.ones_like(PRESSURES), PRESSURES])
    (cohesions, slopes), *_ = np.linalg.lstsq(terms, peaks.T, rcond=None)
    print(f"{len(boxes)} boxes     cohesion [MPa]         friction [°]")
    print("              put in    found      put in    found")
    for (cohesion, friction), c, slope in zip(JOINTS, cohesions, slopes):
        found = np.degrees(np.arctan(slope))
        print(f"{cohesion / 1e6:20.3f} {c / 1e6:8.3f} {friction:11.2f} {found:8.2f}")
        assert abs(c / cohesion - 1) < 0.01 and abs(found - friction) < 0.1
    exact = np.array([c + PRESSURES * np.tan(np.radians(phi)) for c, phi in JOINTS])
    print(f"largest error of a peak {100 * abs(peaks / exact - 1).max():.2f} %")
    draw(folder / "sweep.png", peaks, cohesions, slopes)


def draw(file: Path, peaks: Array, cohesions: Array, slopes: Array) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 6), layout="constrained")
    ends = np.array([0.0, 1.04 * PRESSURES[-1]])
    for number, (cohesion, friction) in enumerate(JOINTS):
        colour = f"C{number}"
        label = f"c = {cohesion / 1e6:g} MPa, φ = {friction:g}°"
        put_in = cohesion + ends * np.tan(np.radians(friction))
        axes.plot(ends / 1e6, put_in / 1e6, color=colour, alpha=0.25, linewidth=7)
        fitted = cohesions[number] + ends * slopes[number]
        axes.plot(ends / 1e6, fitted / 1e6, color=colour, linewidth=1)
        peak_mpa = peaks[number] / 1e6
        axes.plot(PRESSURES / 1e6, peak_mpa, "o", color=colour, markersize=4, label=label)
    axes.set(xlabel="pressure [MPa]", ylabel="shear stress at the peak [MPa]")
    axes.set_title("Shear boxes: peaks, fitted lines, and the strengths put in (broad)")
    axes.set(xlim=(0, ends[1] / 1e6), ylim=(0, None))
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)
    figure.savefig(file, dpi=120)


if __name__ == "__main__":
    main()
