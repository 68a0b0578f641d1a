"""A simply supported beam of 108 blocks under a line load, as in beam.toml.

    python examples/beam.py [folder for the pictures]

Prints the deflection at midspan and writes beam.png and beam.html, which any browser can rotate and
zoom. With intact joints the blocks bend as one beam.
"""

import sys
from pathlib import Path

import ddem

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
folder.mkdir(parents=True, exist_ok=True)

rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
seam = ddem.Joint(thickness=0.01, material=rock)

# The reference value is that of linear theory with the element of the paper.
title = "simply supported beam, 12 x 3 x 3 m"
model = ddem.Model(title=title, kinematics="small", element="standard")
model.add_blocks(size=(12, 3, 3), count=(12, 3, 3), divisions=4, material=rock, joint=seam)
model.fix("xz", x=0.0, z=0.0)  # pinned edge
model.fix("z", x=12.0, z=0.0)  # rolling edge
model.fix("y", x=0.0, y=1.5, z=0.0)  # no sideways drift: one node at each end
model.fix("y", x=12.0, y=1.5, z=0.0)
model.load(line=(0, 0, -600e3), x=6.0, z=3.0)  # N/m: 1.8 MN in total

beam = model.build()
steps = beam.relax(tolerance=1e-8)

middle = beam.nearest_node((6, 1.5, 0))
deflection = -1e3 * beam.displacement[middle, 2]
support = beam.reaction(beam.nodes(z=0.0))[2]
print(f"{beam.n_blocks} blocks, {beam.n_nodes} nodes, relaxed in {steps} steps")
print(f"the supports carry {support / 1e6:.4f} MN, the load is {600e3 * 3 / 1e6:.4f} MN")
print(f"deflection at midspan {deflection:.3f} mm, known 0.681 mm")

ddem.plot(beam, "displacement", screenshot=folder / "beam.png", html=folder / "beam.html")
