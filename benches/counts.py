"""Operations and bytes of a step for each node, counted from the source.

Blocks are cubes with `n` divisions inside of a large lattice with intact joints. Each block owns
its elements and those of the joints at three of its sides: three faces of n x n elements, three
strips of n, and a corner. An addition or a multiplication of one number counts once, and
subtractions count as additions; divisions and roots are a few for each block and are left out.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Count:
    """Additions and multiplications."""

    adds: float = 0.0
    products: float = 0.0

    def __add__(self, other: "Count") -> "Count":
        return Count(self.adds + other.adds, self.products + other.products)

    def __mul__(self, factor: float) -> "Count":
        return Count(self.adds * factor, self.products * factor)


# `element/lattice.rs`: the modes of a station and the forces on its nodes, an element between two.
STATION = Count(adds=24 + 24)
ELEMENT = Count(adds=24 + 24 + 30, products=45)
# A rotated node of a lattice: into the frame, out of it, and its torque; half of each kind.
ROTATED = Count(adds=20, products=20)
# `step/nodes.rs`: (M2), the sums of a damped step, and the new position, for three components.
MOVED = Count(adds=3 * 6, products=3 * 8)


def lattice(rows: int, length: int, nodes: int) -> Count:
    """Elements of a lattice in rows: stations, elements, and sums at nodes of several rows."""
    shared = Count(adds=3 * (4 * rows * (length + 1) - nodes))
    return STATION * (rows * (length + 1)) + ELEMENT * (rows * length) + shared


def parts(n: int = 4) -> dict[str, Count]:
    """Operations for each node, by part of the step."""
    m = n + 1
    nodes = m**3
    lattices = [(1, n * n, m**3), (3, n, 2 * m * m), (3, 1, 4 * m), (1, 1, 8)]
    blocks = lattice(n * n, n, nodes)
    joints = lattice(n, n, 2 * m * m) * 3 + lattice(1, n, 4 * m) * 3 + lattice(1, 1, 8)
    at_joints = 3 * 2 * m * m + 3 * 4 * m + 8
    joints += Count(adds=3 * at_joints)
    rotated = sum(number * count for number, _, count in lattices)
    return {
        "blocks": blocks * (1 / nodes),
        "joints": joints * (1 / nodes),
        "nodes": MOVED,
        "rotations": ROTATED * (rotated / nodes),
    }


def operations(kinematics: str) -> Count:
    """Operations for each node and step."""
    found = parts()
    total = found["blocks"] + found["joints"] + found["nodes"]
    return total + found["rotations"] if kinematics == "corotational" else total


# Bytes for each node. A vector has 24 bytes, and a cache line that is written without being read
# is read first. Joints act on 127 nodes of the next blocks for each 125 nodes.
VECTOR = 24.0
ON_NEXT = VECTOR * 127 / 125
# First pass: u in, forces out; second pass: forces in and out, u and v in and out; forces on the
# next blocks out and in.
TWO_PASSES = VECTOR + 2 * VECTOR + 2 * VECTOR + 4 * VECTOR + 3 * ON_NEXT
# In a sweep forces stay in the cache; those on the next blocks are written back.
SWEEP = 4 * VECTOR + 2 * ON_NEXT
FEWEST_IN_SWEEP = 300_000


def traffic(nodes: int) -> float:
    """Bytes moved for each node and step if the model is out of cache."""
    return SWEEP if nodes >= FEWEST_IN_SWEEP else TWO_PASSES
