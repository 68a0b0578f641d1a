//! Tests of the detection of blocks that continue to move, with motions given step by step.

use super::*;

/// Watch of a motion over some steps.
fn watched(steps: u64, motion: impl Fn(f64) -> [f64; 2]) -> MotionWatch {
    flown(steps, |steps| (motion(steps), 0.0))
}

/// Watch with blocks in flight.
fn flown(steps: u64, motion: impl Fn(f64) -> ([f64; 2], f64)) -> MotionWatch {
    let sample = |i: u64| {
        let ([touching, ratio], flight) = motion((i * SAMPLE_INTERVAL) as f64);
        [touching, ratio, flight]
    };
    MotionWatch {
        settling_steps: 400,
        samples: (1..=steps / SAMPLE_INTERVAL).map(sample).collect(),
        ..MotionWatch::default()
    }
}

#[test]
fn sliding_under_constant_force_fails() {
    // Slip of a free block in a relaxation grows with the square of the steps.
    let slides = |steps: f64| [1e-8 * steps * steps, 3e-3];
    assert!(!watched(800, slides).fails(FAR));
    assert!(watched(2000, slides).fails(FAR));
    // A slow motion fails, too, in the end.
    let creeps = |steps: f64| [1e-12 * steps * steps, 3e-3];
    assert!(!watched(2000, creeps).fails(FAR));
    assert!(watched(6000, creeps).fails(FAR));
}

#[test]
fn motion_with_fading_force_does_not_fail() {
    let fades = |steps: f64| [0.5 * (1.0 - (-steps / 500.0).exp()), (-steps / 500.0).exp()];
    let swings = |steps: f64| [0.1 * (1.0 - (steps / 900.0).cos()), (steps / 900.0).cos().abs()];
    for steps in (1000..20_000).step_by(200) {
        assert!(!watched(steps, fades).fails(FAR), "{steps}");
        assert!(steps < 2000 || !watched(steps, |s| [swings(s)[0], 1e-2 / s]).fails(FAR));
    }
}

#[test]
fn swinging_under_constant_force_rattles() {
    let samples = |ratio: fn(f64) -> f64| watched(2000, |steps| [1e-5 * steps.sin(), ratio(steps)]);
    assert!(samples(|_| 1e-4).rattles(2000));
    assert!(!samples(|_| 1e-4).rattles(1900));
    assert!(!samples(|steps| 1.0 / steps).rattles(2000));
}

#[test]
fn dynamic_rest_needs_balance_without_motion() {
    let rests = |steps: f64| [0.01 * (1.0 - (-steps / 500.0).exp()), 1e-4];
    assert_eq!(watched(10_000, rests).verdict(1e-4), Verdict::AtRest);
    assert_eq!(watched(10_000, rests).verdict(0.1), Verdict::Undecided);
    let slides = |steps: f64| [1e-8 * steps * steps, 1e-4];
    assert_eq!(watched(10_000, slides).verdict(1e-4), Verdict::Fails);
    let creeps = |steps: f64| [1e-13 * steps * steps, 1e-4];
    assert_eq!(watched(10_000, creeps).verdict(1e-4), Verdict::Undecided);
    // Blocks settle first and then begin to slide.
    let settles =
        |steps: f64| [2e-5 * (1.0 - (-steps / 200.0).exp()) + 5e-13 * steps * steps, 1e-4];
    assert_eq!(watched(4000, settles).verdict(1e-4), Verdict::Undecided);
    // Blocks swing on soft springs.
    let swings = |steps: f64| [3e-5 * (1.0 + (steps / 700.0).sin()), 1e-4];
    assert_eq!(watched(40_000, swings).verdict(1e-4), Verdict::AtRest);
    // Blocks shift late in the stage and then stop.
    let shifts = |steps: f64| [if steps < 6000.0 { 0.0 } else { 5e-6 }, 1e-4];
    assert_eq!(watched(10_000, shifts).verdict(1e-4), Verdict::AtRest);
    assert_eq!(watched(7_000, shifts).verdict(1e-4), Verdict::Undecided);
    assert_eq!(MotionWatch::default().verdict(1e-4), Verdict::AtRest);
}

/// Ten million steps of blocks that slide at constant speed, and of others that stop halfway: the
/// samples of every 16th interval are left.
#[test]
fn long_stages_keep_few_samples_and_their_verdicts() {
    let long = |motion: &dyn Fn(f64) -> f64| {
        let mut watch = MotionWatch::default();
        for step in (SAMPLE_INTERVAL..=10_000_000).step_by(SAMPLE_INTERVAL as usize) {
            if step.is_multiple_of(watch.interval()) {
                watch.add([motion(step as f64), 1e-4, 0.0]);
                assert_eq!(watch.samples.len() as u64, step / watch.interval());
                assert!(watch.samples.len() < MOST_SAMPLES);
            }
        }
        assert_eq!(watch.interval(), 16 * SAMPLE_INTERVAL);
        watch.verdict(1e-4)
    };
    assert_eq!(long(&|steps| 1e-7 * steps), Verdict::Fails);
    assert_eq!(long(&|steps| 1e-7 * steps.min(5e6)), Verdict::AtRest);
}

#[test]
fn decelerating_blocks_do_not_fail() {
    // Blocks slide to rest from 3 m/s over 1e5 steps of 10 µs.
    let to_rest = |steps: f64| {
        let left = 1.0 - (steps / 1e5).min(1.0);
        [1.5 * (1.0 - left * left), 1e-4]
    };
    for steps in (2000..100_000).step_by(200) {
        assert_eq!(watched(steps, to_rest).decided(0.1), None, "{steps}");
    }
    assert_eq!(watched(140_000, to_rest).decided(1e-4), Some(Verdict::AtRest));
    let steady = |steps: f64| [3e-5 * steps, 1e-4];
    assert_eq!(watched(10_000, steady).verdict(0.1), Verdict::Fails);
    assert_eq!(watched(10_000, steady).decided(0.1), None);
    assert_eq!(watched(40_000, steady).decided(0.1), Some(Verdict::Fails));
}

#[test]
fn falling_blocks_may_land() {
    // Blocks fall by two edges within 10 000 steps and lie on others afterwards.
    let lands = |steps: f64| {
        let fallen = 2.0 * (steps / 1e4).min(1.0).powi(2);
        if steps < 1e4 { ([0.0, 1.0], fallen) } else { ([fallen, 1e-4], 0.0) }
    };
    for steps in (2000..16_000).step_by(200) {
        assert_eq!(flown(steps, lands).decided(1.0), None, "{steps}");
    }
    assert_eq!(flown(8000, lands).verdict(1.0), Verdict::Fails);
    assert_eq!(flown(40_000, lands).decided(1e-4), Some(Verdict::AtRest));
}
