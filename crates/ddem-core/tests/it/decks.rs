//! Decks, motions and sums that several tests use.

use ddem_core::{Model, Simulation};
use ddem_deck::{
    BlockSet, BuiltDeck, Deck, Extent, Fix, Joint, JointChoice, Material, Stage, Where,
};
use nalgebra::{Rotation3, Unit};

pub(crate) use ddem_mesh::Vec3;

pub(crate) const BOX: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
pub(crate) const OBLIQUE: [[f64; 3]; 3] = [[1.0, 0.1, 0.0], [0.3, 1.0, -0.2], [0.25, 0.2, 1.0]];

/// Oblique axes, except that the third normal is the z axis.
pub(crate) const LEANING: [[f64; 3]; 3] = [[1.0, 0.1, 0.0], [0.3, 1.0, 0.0], [0.25, 0.2, 1.0]];

/// Blocks of rock between softer seams.
pub(crate) fn deck(count: [u32; 3], size: [f64; 3], divisions: u32, thickness: f64) -> Deck {
    let rock = Material { density: 2400.0, young: 18e9, poisson: 0.25 };
    let clay = Material { density: 2000.0, young: 3e9, poisson: 0.3 };
    let section = Joint { thickness, material: Some("clay".into()), ..Joint::default() };
    Deck {
        materials: [("rock".to_owned(), rock), ("clay".to_owned(), clay)].into(),
        joints: [("seam".to_owned(), section)].into(),
        blocks: vec![BlockSet {
            size: Some(size),
            count: Some(count),
            divisions,
            material: "rock".into(),
            joint: Some(JointChoice::All("seam".into())),
            ..BlockSet::default()
        }],
        ..Deck::default()
    }
}

pub(crate) fn with_axes(mut deck: Deck, axes: [[f64; 3]; 3]) -> Deck {
    deck.blocks[0].axes = axes;
    deck
}

pub(crate) fn simulation(deck: &Deck) -> Simulation {
    Simulation::new(model(deck))
}

pub(crate) fn model(deck: &Deck) -> Model {
    deck.build().unwrap_or_else(|error| panic!("{error}"))
}

/// Built deck of a deck without errors.
pub(crate) fn built(deck: &Deck) -> BuiltDeck {
    BuiltDeck::new(deck).unwrap_or_else(|error| panic!("{error}"))
}

/// Warnings about the model of a deck.
pub(crate) fn warnings(deck: &Deck) -> Vec<String> {
    let site = built(deck);
    site.warnings(&site.model()).iter().map(ToString::to_string).collect()
}

pub(crate) fn plane(axis: usize, at: f64) -> Where {
    let mut planes = [None; 3];
    planes[axis] = Some(Extent::Plane(at));
    let [x, y, z] = planes;
    Where { x, y, z, ..Where::default() }
}

pub(crate) fn fix(region: Where, axes: &str) -> Fix {
    Fix { r#where: region, axes: axes.into(), ..Fix::default() }
}

pub(crate) fn relax_stage(name: &str) -> Stage {
    Stage { name: name.into(), ..Stage::default() }
}

/// Random numbers in (−1, 1) from a seed, the same on every machine.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub(crate) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub(crate) fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }

    pub(crate) fn rotation(&mut self, angle: f64) -> Rotation3<f64> {
        Rotation3::from_axis_angle(&Unit::new_normalize(self.vector()), angle)
    }
}

pub(crate) fn points(model: &Model) -> Vec<Vec3> {
    (0..model.n_nodes()).map(|node| Vec3::from(model.point(node))).collect()
}

/// Sum of the forces over the sum of their sizes, and the same for moments about a point in the
/// deformed position.
pub(crate) fn sums(points: &[Vec3], u: &[[f64; 3]], f: &[[f64; 3]], about: Vec3) -> [f64; 2] {
    let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
    let (mut forces, mut moments) = (0.0, 0.0);
    for ((x, u), f) in points.iter().zip(u).zip(f) {
        let (arm, f) = (x + Vec3::from(*u) - about, Vec3::from(*f));
        force += f;
        moment += arm.cross(&f);
        forces += f.norm();
        moments += arm.norm() * f.norm();
    }
    [force.norm() / forces, moment.norm() / moments]
}

pub(crate) fn largest(values: &[[f64; 3]]) -> f64 {
    values.iter().flatten().fold(0.0, |most, x| f64::max(most, x.abs()))
}

/// Bits of numbers, for exact comparison.
pub(crate) fn bits(values: &[[f64; 3]]) -> Vec<u64> {
    values.iter().flatten().map(|x| x.to_bits()).collect()
}

/// Checks that a deck is refused with an error that contains these words.
pub(crate) fn refused(deck: &Deck, words: &[&str]) {
    let Err(error) = deck.build() else { panic!("accepted: {words:?}") };
    let text = error.to_string();
    for word in words {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
}
