//! Joints that break: the same bits on any number of threads, and with strengths that are not
//! reached.

use ddem_core::{FIELDS, FieldLocation, Simd, Simulation};
use ddem_deck::TimeStep;

use super::bits::output_bits;
use super::decks::MATTER;
use super::shared::deck;

/// A pile that settles, is torn by a driven support and then slides. Its thick joints and springs
/// break in every way.
pub(crate) fn torn(strength: f64) -> String {
    let joint = |name: &str, kind: &str, part: f64| {
        let [cohesion, tension] = [0.4e6, 0.2e6].map(|most| most * part * strength);
        format!(
            "[joints.{name}]\n{kind}\ncohesion = {cohesion}\nfriction = 30.0\n\
             tension = {tension}\nresidual_friction = 20.0\ndilation = 4.0\n"
        )
    };
    let thick = joint("thick", "thickness = 0.01\nmaterial = 'rock'", 1.0);
    let spring = "thickness = 0.0\nnormal_stiffness = 1e11\nshear_stiffness = 4e10";
    let (spring, soft) = (joint("spring", spring, 0.5), joint("soft", spring, 0.4));
    let energies = [300.0, 900.0].map(|most| most * strength * strength);
    format!(
        "{MATTER}{thick}{spring}{soft}fracture_energy = {energies:?}
[model]
contact = false
peaks = true
gravity = [0.0, 0.0, -9.81]
[[blocks]]
size = [2.5, 1.0, 1.5]
count = [5, 2, 3]
divisions = 4
material = 'rock'
joint = {{ x = 'thick', y = 'spring', z = 'soft' }}
[[fix]]
where = {{ z = 0.0 }}
axes = 'xyz'
[[fix]]
where = {{ x = 2.5 }}
axes = 'x'
velocity = [0.5, 0.0, 0.0]
from = 'pull'
[[load]]
where = {{ z = 1.5 }}
traction = [2e5, 3e5, -1e5]
from = 'pull'
[[stage]]
name = 'settle'
kind = 'relax'
[[stage]]
name = 'pull'
kind = 'dynamic'
duration = 6e-3
damping = {{ ratio = 0.01 }}
frames = 5
[[probe]]
name = 'top'
at = [2.5, 1.0, 1.5]
quantity = 'displacement'
every = 1e-5
"
    )
}

#[test]
fn failure_bits_are_independent_of_threads_and_simd() {
    let text = torn(1.0);
    let expected = output_bits(&text, 1, Simd::default(), 250);
    let [shear, tension] = expected.0;
    assert!(shear > 50 && tension > 50, "{shear} and {tension} pairs have failed");
    for threads in [2, 3] {
        assert!(output_bits(&text, threads, Simd::default(), 250) == expected, "{threads} threads");
    }
    for (name, simd) in Simd::available() {
        assert!(output_bits(&text, 1, simd, 250) == expected, "{name}");
    }
}

#[test]
fn unreached_strength_changes_no_bit() {
    let strong = torn(1e4);
    let strengths = ["cohesion", "friction", "tension", "residual", "dilation", "fracture"];
    let lines = strong.lines();
    let unbreakable = lines.filter(|line| !strengths.iter().any(|key| line.starts_with(key)));
    let unbreakable = unbreakable.collect::<Vec<_>>().join("\n");
    let displacements = |text: &str| {
        let mut simulation = Simulation::new(deck(text).build().expect("a model"));
        simulation.enter(0).unwrap_or_else(|error| panic!("{error}"));
        simulation.relax(1e-5, 10_000).expect("equilibrium");
        simulation.enter(1).unwrap_or_else(|error| panic!("{error}"));
        simulation.start(Default::default(), TimeStep::Auto, None).expect("a stable step");
        for _ in 0..100 {
            simulation.step().expect("finite numbers");
        }
        assert_eq!(simulation.failed_pairs(), [0, 0]);
        let nodes = FIELDS.iter().filter(|field| field.on == FieldLocation::Node);
        let values: Vec<f64> =
            nodes.flat_map(|field| simulation.snapshot().values(field)).collect();
        values.into_iter().map(f64::to_bits).collect::<Vec<_>>()
    };
    assert!(displacements(&strong) == displacements(&unbreakable));
}
