//! Tests of the friction of two faces against its definition.

use super::*;
use ddem_mechanics::law::{MohrCoulomb, ReducedLaw};

/// Strength `0.2 MPa + √(p · 1 MPa)`, which no friction angle can represent.
#[derive(Debug)]
struct Root;

impl JointLaw for Root {
    fn tension(&self) -> f64 {
        0.0
    }

    fn peak(&self, normal: f64) -> f64 {
        self.residual(normal)
    }

    fn residual(&self, normal: f64) -> f64 {
        2e5 + (-normal * 1e6).max(0.0).sqrt()
    }
}

fn coulomb(tan: f64) -> Arc<dyn JointLaw> {
    let strength =
        MohrCoulomb { tan_friction: tan, tan_residual_friction: tan, ..MohrCoulomb::default() };
    Arc::new(strength)
}

/// Laws with the tangents 0.5 and 0.8, the root law, no law, and half of the root law.
fn laws() -> Laws {
    let half = ReducedLaw { law: Arc::new(Root), factor: 2.0 };
    vec![Some(coulomb(0.5)), Some(coulomb(0.8)), Some(Arc::new(Root)), None, Some(Arc::new(half))]
}

fn face(number: usize) -> Option<FaceFriction> {
    FaceFriction::new(&laws(), number)
}

fn of(a: usize, b: usize) -> Option<Friction> {
    Friction::of([face(a), face(b)], 1.0)
}

fn at(friction: Option<Friction>, pressure: f64) -> f64 {
    friction.map_or(f64::NAN, |friction| friction.strength(&laws(), -pressure))
}

#[test]
fn constant_frictions_reduce_to_one_angle() {
    assert_eq!(of(0, 1), Some(Friction::Angle(0.5)));
    assert_eq!(of(3, 1), Some(Friction::Angle(0.8)));
    assert_eq!(of(3, 3), None);
    assert!(matches!(of(2, 2), Some(Friction::Laws(_))));
}

/// The strength is 1 MPa at 1 MPa and 4 MPa at 16 MPa, without the cohesion.
#[test]
fn law_strength_follows_pressure() {
    for friction in [of(2, 2), of(2, 3), of(3, 2)] {
        assert!((at(friction, 1e6) - 1e6).abs() < 1e-3);
        assert!((at(friction, 16e6) - 4e6).abs() < 1e-3);
        assert_eq!(at(friction, 0.0), 0.0);
    }
    assert!((at(of(4, 4), 16e6) - 2e6).abs() < 1e-3, "with a factor of safety");
}

/// The root law is stronger than 0.5 p below 4 MPa and weaker above.
#[test]
fn weaker_face_governs_at_each_pressure() {
    for friction in [of(0, 2), of(2, 0)] {
        assert!((at(friction, 1e6) - 0.5e6).abs() < 1e-3);
        assert!((at(friction, 16e6) - 4e6).abs() < 1e-3);
    }
}

#[test]
fn edge_has_mean_friction_of_its_faces() {
    let mean = |a: usize, b: usize| Some(face(a)?.mean(face(b)?));
    let edge = |other: usize| Friction::of([mean(0, 2), face(other)], 1.0);
    assert!((at(edge(3), 16e6) - 6e6).abs() < 1e-3);
    assert!((at(edge(1), 16e6) - 6e6).abs() < 1e-3);
    assert!((at(edge(2), 16e6) - 4e6).abs() < 1e-3);
    assert_eq!(Friction::of([mean(0, 1), None], 1.0), Some(Friction::Angle(0.65)));
}

/// The strength is a quarter of the way from 0.5 to the root law at 16 MPa, and from 0.5 to 0.8.
#[test]
fn strengths_are_interpolated_by_share() {
    let ramp = |old: usize, new: usize| Some(face(new)?.after(face(old)?, 0.25));
    let of = |old: usize, new: usize| Friction::of([ramp(old, new); 2], 0.25);
    assert!((at(of(0, 2), 16e6) - 7e6).abs() < 1e-3);
    assert!((at(of(0, 1), 16e6) - 9.2e6).abs() < 1e-3);
    assert!(matches!(of(0, 1), Some(Friction::Angle(_))));
}

/// Points with 1.25 times the area on which they press carry the same force.
#[test]
fn area_scale_changes_no_force() {
    let Some(mut friction) = of(2, 2) else { panic!("no friction") };
    let force = friction.strength(&laws(), -10e6);
    friction.set_stretch(1.25);
    assert!((friction.strength(&laws(), -8e6) * 1.25 / force - 1.0).abs() < 1e-12);
}

#[test]
fn numbers_without_law_are_detected() {
    for (at, sound) in [(2, true), (0, false)] {
        let few = &laws()[..=at];
        assert_eq!(of(2, 2).is_some_and(|friction| friction.is_sound(few)), sound);
    }
    assert!(!Friction::Angle(f64::NAN).is_sound(&laws()));
}
