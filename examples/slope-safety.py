"""Factor of safety of a slope in bedded rock, and the influence of the friction of the bedding.

The slope is that of slope-safety.toml: a face of 60 degrees, 12 m high, in layers that dip at 30
degrees out of it. Prints the factor of safety for three friction angles, and draws the moving
blocks.

    python examples/slope-safety.py [FOLDER]
"""

import sys

import ddem


def slope(friction: float) -> ddem.Model:
    """Model for a friction angle of the bedding [degrees]."""
    stiffness = {"normal_stiffness": 5e9, "shear_stiffness": 2e9}
    rock = ddem.Material(density=2600, young=20e9, poisson=0.25)
    bedding = ddem.Joint(name="bedding", friction=friction, cohesion=20e3, residual_cohesion=20e3, **stiffness)
    cross = ddem.Joint(name="cross", friction=40.0, **stiffness)
    model = ddem.Model(title=f"bedding of {friction:g} degrees", gravity=(0, 0, -9.81))
    model.add_blocks(
        origin=(-7.196, 0, -0.464), size=(30, 1, 20), count=(15, 1, 16), dip=30, dip_direction=90,
        divisions=1, material=rock, joint={"x": cross, "y": cross, "z": bedding},
    )  # fmt: skip
    face = {"point": (10, 0, 12), "dip": 60, "dip_direction": 90}
    model.remove(above=face, z=(0, 100))
    model.remove(above=12.0)
    model.remove(below=-4.0)
    model.remove(x=(-100, 0))
    model.remove(x=(24, 100))
    model.fix("xyz", below=-3.0)
    model.fix("xyz", x=(-100, 1))
    model.fix("xyz", x=(23, 100))
    model.fix("y")
    return model


for friction in (30.0, 34.0):
    safety = ddem.factor_of_safety(slope(friction), bracket=(1.0, 2.0), resolution=0.02)
    print(f"{friction:g} degrees: factor of safety {safety.factor:.3f}, {len(safety.moving)} blocks move")

# The same as stages of a run, whose last frame is the failing trial.
model = slope(32.0)
model.stage("weight", kind="relax")
model.stage("safety", kind="safety", bracket=(1.0, 2.0))
folder = sys.argv[1] if len(sys.argv) > 1 else "results/slope-safety-python"
done = ddem.run_deck(model, out=folder)
print(f"32 degrees: factor of safety {done.summary['stages'][-1]['factor']:.3f}")
ddem.plot(folder, "displacement", frame=-1, view="xz", moving=True, screenshot=f"{folder}/slope.png")
