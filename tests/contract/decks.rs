//! Decks of the tests.

/// Rock, joints of rock and stiffer joints.
pub(crate) const MATTER: &str = "
[materials.rock]
density = 2400.0
young = 18e9
poisson = 0.25
[joints.seam]
thickness = 0.01
material = 'rock'
[joints.stiff]
thickness = 0.02
density = 5000.0
young = 60e9
poisson = 0.2
";

/// A relaxation in increments, then two dynamic stages: driven support, damping, loads that start,
/// change and end. Five blocks along x, so that packs of four are not filled.
pub(crate) const MIXED: &str = "
title = 'relaxed, shaken, let go'
[model]
gravity = [0.0, 0.0, -9.81]
[[blocks]]
name = 'wall'
size = [2.5, 1.0, 1.5]
count = [5, 2, 3]
divisions = 2
material = 'rock'
joint = { x = 'seam', y = 'seam', z = 'stiff' }
[[remove]]
where = { sphere = { centre = [1.25, 0.25, 0.75], radius = 0.1 } }
[[fix]]
where = { z = 0.0 }
axes = 'yz'
[[fix]]
where = { x = 0.0, z = 0.0 }
axes = 'x'
until = 'shake'
[[fix]]
where = { x = 0.0, z = 0.0 }
axes = 'x'
velocity = [0.3, 0.0, 0.0]
history = { table = [[0, 0], [5e-4, 1], [1e-3, -1], [2e-3, 0]] }
from = 'shake'
[[load]]
where = { z = 1.5 }
pressure = 2e5
[[load]]
where = { x = 2.5 }
traction = [3e5, 1e5, 0.0]
history = { ramp = 5e-4 }
from = 'shake'
until = 'ring'
[[stage]]
name = 'settle'
kind = 'relax'
tolerance = 1e-6
increments = 3
[[stage]]
name = 'shake'
kind = 'dynamic'
duration = 2e-3
damping = { ratio = 0.01 }
frames = 7
[[stage]]
name = 'ring'
kind = 'dynamic'
duration = 1e-3
damping = { local = 0.1 }
frames = 3
[[probe]]
name = 'top'
at = [2.5, 1.0, 1.5]
quantity = 'displacement'
every_steps = 7
[[probe]]
name = 'pace'
where = { x = 2.5 }
quantity = 'velocity'
every = 1e-5
every_steps = 50
[[probe]]
name = 'base'
where = { z = 0.0 }
quantity = 'reaction'
[[probe]]
name = 'middle'
at = [0.6, 0.6, 0.6]
quantity = 'stress'
every = 3e-5
";

/// Text of the mixed deck.
pub(crate) fn mixed() -> String {
    format!("{}{MATTER}", MIXED)
}

/// Cells of a region, some of them joined: a relaxation under weight, then a shock by which joints
/// fail. Thin cells have scaled inertia.
pub(crate) const CELLS: &str = "
title = 'cells'
[model]
gravity = [0.0, 0.0, -9.81]
[materials.rock]
density = 2400.0
young = 18e9
poisson = 0.25
[joints.seam]
normal_stiffness = 5e9
shear_stiffness = 2e9
cohesion = 2e4
friction = 35.0
tension = 1e4
[[region]]
name = 'rock'
box = { from = [0, 0, 0], to = [3, 3, 3] }
material = 'rock'
divisions = 4
[[cut]]
set = { dip = 40, dip_direction = 130, spacing = 1.1 }
joint = 'seam'
[[cut]]
set = { dip = 80, dip_direction = 250, spacing = 1.3 }
join = true
[[cut]]
set = { dip = 70, dip_direction = 20, spacing = 1.2 }
joint = 'seam'
[[fix]]
where = { z = 0.0 }
axes = 'xyz'
[[load]]
where = { z = 3.0 }
force = [4e5, 2e5, 1e5]
from = 'shake'
history = { ramp = 2e-3 }
[[stage]]
name = 'rest'
kind = 'relax'
tolerance = 1e-6
[[stage]]
name = 'shake'
kind = 'dynamic'
duration = 4e-3
frames = 4
damping = { ratio = 0.02 }
[[probe]]
name = 'top'
where = { z = 3.0 }
quantity = 'displacement'
every = 2e-5
[[probe]]
name = 'base'
where = { z = 0.0 }
quantity = 'reaction'
every = 2e-5
";
