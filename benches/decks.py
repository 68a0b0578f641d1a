"""Decks of the benchmarks, as text."""

ROCK = """
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
"""


def lattice(
    count: int,
    *,
    divisions: int = 4,
    kinematics: str = "corotational",
    element: str = "incompatible",
    strength: str = "",
    gravity: float = 0.0,
    floor: bool = False,
) -> str:
    """Cubes of a metre with joints of rock, 1 cm thick; `strength` has keys of the joint."""
    size = [count] * 3
    held = "[[fix]]\nwhere = { z = 0.0 }\naxes = 'xyz'\n" if floor else ""
    return f"""
[model]
contact = false
kinematics = '{kinematics}'
element = '{element}'
gravity = [0, 0, {gravity}]
{ROCK}
[joints.seam]
thickness = 0.01
material = 'rock'
{strength}
[[blocks]]
size = {size}
count = {size}
divisions = {divisions}
material = 'rock'
joint = 'seam'
{held}"""


def springs(count: int) -> str:
    """Cubes of a metre with one division that meet in contact. Their joints are springs, which break
    under the weight."""
    return f"""
[model]
gravity = [6, 1, -9.81]
{ROCK}
[joints.seam]
normal_stiffness = 2e10
shear_stiffness = 1e10
friction = 30
cohesion = 1e4
tension = 1e4
[[blocks]]
size = {[count] * 3}
count = {[count] * 3}
divisions = 1
material = 'rock'
joint = 'seam'
[[fix]]
where = {{ z = 0.0 }}
axes = 'xyz'
"""


def stepping(duration: float, name: str = "steps") -> str:
    """Dynamic stage with damping."""
    return f"""
[[stage]]
name = '{name}'
kind = 'dynamic'
duration = {duration!r}
damping = {{ ratio = 0.05 }}
frames = 1
"""


def relaxing(steps: int) -> str:
    """Relax stage that ends after a number of steps."""
    return f"""
[[stage]]
name = 'steps'
kind = 'relax'
tolerance = 1e-14
max_steps = {steps}
on_failure = 'continue'
"""


def torn(count: int) -> str:
    """Velocities that drive the blocks towards and past each other, so that all joints fail."""
    entries = []
    for k in range(count**3):
        cell = [k % count, k // count % count, k // count**2]
        ranges = ", ".join(f"{axis} = [{i + 0.1}, {i + 0.9}]" for axis, i in zip("xyz", cell))
        velocity = [
            0.02 * ((k * (7 + 4 * c)) % 5 - 2) - 0.05 * (i + 0.5 - count / 2)
            for c, i in enumerate(cell)
        ]
        entries.append(
            f"[[initial]]\nwhere = {{ {ranges} }}\nvelocity = {[round(v, 6) for v in velocity]}\n"
        )
    return "".join(entries)
