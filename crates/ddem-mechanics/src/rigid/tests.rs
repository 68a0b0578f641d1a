use super::*;

const WHOLE: RigidCoefficients = RigidCoefficients { interval: 1e-3, rates: [0.0; 4] };

fn brick() -> MassProperties {
    let edges =
        [Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 2.0, 0.0), Vector3::new(0.0, 0.0, 3.0)];
    MassProperties::new(6.0, edges, Vector3::zeros())
}

#[test]
fn inertia_of_brick_is_exact() {
    let exact = [13.0, 10.0, 5.0].map(|sum| 6.0 / 12.0 * sum);
    for (k, exact) in exact.into_iter().enumerate() {
        assert!((brick().inertia[(k, k)] / exact - 1.0).abs() < 1e-14);
    }
    // A sheared brick keeps the plane moments of its edges.
    let edges = [Vector3::x(), Vector3::new(0.5, 1.0, 0.0), Vector3::z()];
    let sheared = MassProperties::new(12.0, edges, Vector3::zeros());
    assert!((sheared.inertia[(2, 2)] - (1.0 + 0.25 + 1.0)).abs() < 1e-14);
    assert!((sheared.inertia[(0, 1)] + 0.5).abs() < 1e-14);
}

#[test]
fn corner_forces_give_same_wrench() {
    let (mass_properties, turn) = (brick(), UnitQuaternion::from_euler_angles(0.3, -1.0, 2.0));
    let wrench = SpatialVector {
        linear: Vector3::new(1.0, -2.0, 0.5),
        angular: Vector3::new(0.2, 3.0, -1.0),
    };
    let SpatialVector { linear, angular } = mass_properties.corner_forces(&turn, wrench);
    let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
    for corner in 0..8 {
        let arm = turn * mass_properties.arm(corner);
        let f = linear + angular.cross(&arm);
        force += f;
        torque += arm.cross(&f);
    }
    assert!((force - wrench.linear).norm() < 1e-14 && (torque - wrench.angular).norm() < 1e-14);
}

/// A brick that tumbles about its middle axis, where rotation is unstable, conserves momentum and
/// energy.
#[test]
fn free_brick_keeps_momentum_and_energy() {
    let mass_properties = brick();
    let energy = |step: f64| {
        let mut pose = Pose { velocity: Vector3::x(), ..Pose::default() };
        pose.momentum = mass_properties.inertia * Vector3::new(0.01, 2.0, 0.02);
        let (first, momentum) = (pose.kinetic(&pose, &mass_properties), pose.momentum);
        let mut worst: f64 = 0.0;
        let steps = (40.0 / step) as usize;
        for _ in 0..steps {
            pose = pose.accelerated(
                &mass_properties,
                &RigidCoefficients { interval: step, ..WHOLE },
                &SpatialVector::default(),
            );
            (pose, _) = pose.moved(&mass_properties, step);
            worst = worst.max((pose.kinetic(&pose, &mass_properties) / first - 1.0).abs());
        }
        assert_eq!(pose.momentum, momentum);
        assert!((pose.shift.x - 40.0).abs() < 1e-9);
        assert!((pose.turn.norm() - 1.0).abs() < 1e-15);
        worst
    };
    let [coarse, fine] = [energy(2e-2), energy(1e-2)];
    assert!(coarse < 1e-3 && (3.5..4.5).contains(&(coarse / fine)), "{coarse} {fine}");
}

#[test]
fn hinge_leaves_one_rotation() {
    let mass_properties = brick();
    // Two corners of an edge along y are held in all directions.
    let arms = [0, 2].map(|corner| mass_properties.arm(corner));
    let supports = || arms.iter().flat_map(|arm| (0..3).map(|axis| (*arm, axis, 0.0)));
    let constraint = RigidConstraint::new(mass_properties.size(), supports()).unwrap();
    assert!(!constraint.is_whole());
    let weight = SpatialVector { linear: Vector3::new(0.0, 0.0, -60.0), angular: Vector3::zeros() };
    let turn = UnitQuaternion::identity();
    let free = WHOLE.accelerations(&mass_properties, &turn, &weight);
    let answer = constraint.reaction_wrench(&mass_properties, &WHOLE, &turn, free);
    let sum = SpatialVector { linear: weight.linear + answer.linear, angular: answer.angular };
    let twist = WHOLE.accelerations(&mass_properties, &turn, &sum);
    // A plate that swings as a pendulum: α = m g (b/2) / (m (b² + h²)/3).
    let exact = 60.0 * 0.5 / (6.0 * 10.0 / 3.0) * 1e-3;
    assert!((twist.angular.y / exact - 1.0).abs() < 1e-12, "{}", twist.angular);
    for arm in arms {
        assert!((twist.linear + twist.angular.cross(&arm)).norm() < 1e-15);
    }
    // The reactions add up to the reaction wrench.
    let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
    for (arm, axis, _) in supports() {
        let reaction = Vector3::ith(axis, 1.0) * constraint.reaction(answer, arm, axis);
        force += reaction;
        torque += arm.cross(&reaction);
    }
    assert!((force - answer.linear).norm() < 1e-12 && (torque - answer.angular).norm() < 1e-12);
}

/// Two parts of a tetrahedron-like body: their corner forces are together equivalent to a wrench, and
/// their corners give back the motion of the body.
#[test]
fn parts_of_a_body_share_wrench_and_motion() {
    let corner = |k: usize, at: [f64; 3]| {
        let end = |d: usize| if k >> d & 1 == 1 { 1.0 + 0.2 * at[d] } else { -0.3 };
        Vector3::new(end(0) + at[0], end(1) + at[1], end(2) * (1.0 + 0.1 * k as f64) + at[2])
    };
    let arms: [[Vector3<f64>; 8]; 2] =
        [[0.2, -0.1, 0.4], [-1.5, 0.7, 0.3]].map(|at| std::array::from_fn(|k| corner(k, at)));
    let all: Vec<Vector3<f64>> = arms.iter().flatten().copied().collect();
    let inertia = Matrix3::new(3.0, 0.2, -0.1, 0.2, 2.5, 0.3, -0.1, 0.3, 2.0);
    let whole = MassProperties::with_inertia(7.0, &inertia, Vector3::zeros());
    assert!((whole.inertia - inertia).amax() < 1e-14, "{}", whole.inertia);
    let body = CornerMoments::new(&all);
    let parts = arms.map(|arms| whole.clone().with_corners(arms, body));

    let turn = UnitQuaternion::from_euler_angles(0.3, -1.0, 2.0);
    let wrench = SpatialVector {
        linear: Vector3::new(1.0, -2.0, 0.5),
        angular: Vector3::new(0.2, 3.0, -1.0),
    };
    let mut sum = SpatialVector::default();
    let pose = Pose { shift: Vector3::new(0.1, 2.0, -0.3), turn, ..Pose::default() };
    let spin = Vector3::new(-0.4, 0.7, 1.1);
    for part in &parts {
        let SpatialVector { linear, angular } = part.corner_forces(&turn, wrench);
        for corner in 0..8 {
            let arm = turn * part.arm(corner);
            let f = linear + angular.cross(&arm);
            sum.linear += f;
            sum.angular += arm.cross(&f);
        }
        let arms: [Vector3<f64>; 8] = std::array::from_fn(|corner| part.arm(corner));
        let fitted = Pose::default().from_points(&arms, &arms.map(|arm| pose.displacement(&arm)));
        assert!((fitted.shift - pose.shift).amax() < 1e-14);
        assert!(fitted.turn.angle_to(&turn) < 1e-7);
        let v =
            std::array::from_fn(|corner| wrench.linear + spin.cross(&(turn * part.arm(corner))));
        let moving = pose.with_corner_velocities(part, &v);
        assert!((moving.velocity - wrench.linear).amax() < 1e-14);
        assert!((moving.momentum - whole.momentum(&turn, spin)).amax() < 1e-13);
    }
    assert!((sum.linear - wrench.linear).norm() < 1e-14);
    assert!((sum.angular - wrench.angular).norm() < 1e-13);
}

#[test]
fn rotation_minus_identity_keeps_small_rotations() {
    let x = Vector3::new(3.0, -2.0, 0.7);
    for angle in [1e-12, 1e-5, 0.3, 2.9] {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.6, -0.0, 0.8) * angle);
        let error = minus_identity(&turn) * x - turned_away(&turn, &x);
        assert!(error.norm() <= 1e-15 * angle * x.norm(), "{angle}: {error}");
    }
}
