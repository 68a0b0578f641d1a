"""Four blocks in a row, with the interface of a simulation."""

from types import SimpleNamespace

import numpy as np

CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
)
PAIR = np.dtype(
    [
        ("point", "f8", 3),
        ("nodes", "i8", 2),
        ("joint", "i8"),
        ("displacement", "f8", 3),
        ("traction", "f8", 3),
        ("slip", "f8", 3),
        ("opening", "f8"),
        ("state", "i8"),
        ("open", "i8"),
        ("failure_time", "f8"),
        ("damage", "f8"),
    ]
)


def four_blocks(divisions=2):
    """Four cubes of 1 m in a row along x, with a wave of displacement and joints at x = 1, 2, 3."""
    n = divisions
    steps = np.arange(n + 1) / n
    z, y, x = np.meshgrid(steps, steps, steps, indexing="ij")
    cube = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    number = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)  # z, y, x
    cells = np.array(
        [
            [number[k + c, j + b, i + a] for a, b, c in CORNERS]
            for k in range(n)
            for j in range(n)
            for i in range(n)
        ]
    )
    points = np.concatenate([cube + (block, 0, 0) for block in range(4)])
    elements = np.concatenate([cells + block * len(cube) for block in range(4)])
    displacement = np.zeros_like(points)
    displacement[:, 2] = 0.002 * np.sin(points[:, 0])
    side = np.arange((n + 1) ** 2)
    pairs = np.zeros(3 * len(side), PAIR)
    quads = []
    for joint in range(3):
        part = slice(joint * len(side), (joint + 1) * len(side))
        a = number[:, :, n].reshape(-1) + joint * len(cube)
        b = number[:, :, 0].reshape(-1) + (joint + 1) * len(cube)
        pairs["nodes"][part] = np.stack([a, b], axis=1)
        pairs["point"][part] = points[a]
        pairs["displacement"][part] = 0.5 * (displacement[a] + displacement[b])
        pairs["state"][part] = joint
        at = side.reshape(n + 1, n + 1) + joint * len(side)
        quads.append(np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1))
    pairs["failure_time"] = np.where(pairs["state"] > 0, 0.1 * pairs["state"], np.nan)
    pairs["slip"][:, 1] = 0.01 * pairs["state"]
    pairs["traction"][:, 0] = np.linspace(-1e6, 1e6, len(pairs))
    rng = np.random.default_rng(1)
    history = np.zeros(5, [("time", "f8"), ("step", "i8"), ("x", "f8"), ("y", "f8"), ("z", "f8")])
    history["step"] = 10 * np.arange(5)
    history["z"] = np.arange(5) ** 2

    def field(name, *, nodes=None, out=None):
        raise ValueError(f"unknown field {name}")

    return SimpleNamespace(
        title="four blocks </script><b>",
        time=0.25,
        points=points,
        elements=elements,
        element_block=np.repeat(np.arange(4), len(cells)),
        node_block=np.repeat(np.arange(4), len(cube)),
        displacement=displacement,
        velocity=rng.normal(size=points.shape),
        force=rng.normal(size=points.shape),
        mass=rng.uniform(1.0, 2.0, len(points)),
        stress=rng.normal(scale=1e6, size=(len(elements), 6)),
        pairs=pairs,
        quads=np.concatenate(quads).reshape(-1, 4),
        probes={"top": history},
        summary={"deck": {"probe": [{"name": "top", "quantity": "velocity"}]}},
        field=field,
    )
