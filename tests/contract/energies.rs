//! Every row of `energy.csv` is in balance in all stages.

use super::shared::run;

const COLUMN: &str = "
[model]
gravity = [0.0, 0.0, -9.81]
kinematics = \"small\"
[materials.rock]
density = 2400.0
young = 18e9
poisson = 0.25
[joints.seam]
thickness = 0.01
material = \"rock\"
[[blocks]]
size = [1.0, 1.0, 3.0]
count = [1, 1, 3]
divisions = 2
material = \"rock\"
joint = \"seam\"
[[fix]]
where = { z = 0.0 }
axes = \"xyz\"
[[stage]]
name = \"settle\"
kind = \"relax\"
increments = 3
tolerance = 1e-7
";

const DRIVEN: &str = "
[[fix]]
where = { z = 3.0 }
axes = \"x\"
velocity = [0.1, 0.0, 0.0]
history = { ramp = 2e-3 }
from = \"push\"
[[stage]]
name = \"push\"
kind = \"dynamic\"
duration = 6e-3
";

/// Largest imbalance of a row divided by the largest work.
fn imbalance(deck: &str) -> f64 {
    let run = run(deck);
    let largest = |name: &str| run.energy.column(name).iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    assert!(run.energy.column("balance").len() > 3);
    largest("balance") / largest("external_work")
}

#[test]
fn energies_balance_in_relaxation() {
    let found = imbalance(COLUMN);
    assert!(found < 1e-9, "{found}");
}

#[test]
fn energies_balance_with_every_damping() {
    for damping in ["\"none\"", "{ ratio = 0.02 }", "{ mass = 50.0 }", "{ local = 0.3 }"] {
        let found = imbalance(&format!("{COLUMN}{DRIVEN}damping = {damping}\n"));
        assert!(found < 1e-7, "{damping}: {found}");
    }
}
