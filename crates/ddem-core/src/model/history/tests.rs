use super::*;

#[test]
fn ramp_rises_once() {
    let ramp = History::Ramp(2.0);
    let factors = [-1.0, 0.0, 0.5, 1.0, 2.0, 7.0].map(|time| ramp.factor(time));
    assert_eq!(factors, [0.0, 0.0, 0.25, 0.5, 1.0, 1.0]);
}

#[test]
fn ramp_of_zero_length_is_a_step() {
    let step = History::Ramp(0.0);
    assert_eq!([-1e-9, 0.0, 1e-9, 1.0].map(|time| step.factor(time)), [0.0, 1.0, 1.0, 1.0]);
}

#[test]
fn table_is_linear_between_rows_and_constant_outside() {
    let table = History::Table(vec![[1.0, -2.0], [2.0, 4.0], [4.0, 0.0]]);
    let factors = [-3.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0].map(|time| table.factor(time));
    assert_eq!(factors, [-2.0, -2.0, 1.0, 4.0, 2.0, 0.0, 0.0]);
    let one = History::Table(vec![[1.0, 3.0]]);
    assert_eq!([0.0, 1.0, 2.0].map(|time| one.factor(time)), [3.0; 3]);
    assert_eq!(History::Table(vec![]).factor(1.0), 0.0);
}

#[test]
fn blast_pulse_peaks_at_one_at_exact_time() {
    let pulse = Duvall { alpha: 500.0, beta: 4000.0 };
    // d/dt (e^(-at) - e^(-bt)) = 0 at ln(8)/3500.
    let peak = 8.0_f64.ln() / 3500.0;
    assert!((pulse.peak() - peak).abs() < 1e-15);
    let history = History::Duvall(pulse);
    let highest = (0..=10_000).map(|i| history.factor(f64::from(i) * 1e-6)).fold(0.0, f64::max);
    assert!((history.factor(peak) - 1.0).abs() < 1e-14 && highest <= 1.0 + 1e-14, "{highest}");
    assert!(highest > 1.0 - 1e-6);
    assert_eq!([-1.0, 0.0].map(|time| history.factor(time)), [0.0; 2]);
    // Late values follow the slow exponential alone.
    let late = history.factor(0.02) / history.factor(0.018);
    assert!((late - (-1.0_f64).exp()).abs() < 1e-12);
}

#[test]
fn triangle_rises_and_falls() {
    let fall = Triangle { rise: 1.0, fall: Some(3.0), duration: None };
    let duration = Triangle { rise: 1.0, fall: None, duration: Some(4.0) };
    for pulse in [fall, duration] {
        let history = History::Triangle(pulse);
        let factors = [-1.0, 0.0, 0.5, 1.0, 2.5, 4.0, 9.0].map(|time| history.factor(time));
        assert_eq!(factors, [0.0, 0.0, 0.5, 1.0, 0.5, 0.0, 0.0]);
    }
    let steep = History::Triangle(Triangle { rise: 0.0, fall: Some(2.0), duration: None });
    assert_eq!([-0.1, 0.0, 1.0, 2.0].map(|time| steep.factor(time)), [0.0, 1.0, 0.5, 0.0]);
}

#[test]
fn histories_have_an_end_time() {
    let time_function = |history: History| TimeFunction::new(Some(&history));
    let triangle = Triangle { rise: 1.0, duration: Some(3.0), fall: None };
    let table = History::Table(vec![[0.0, 0.0], [2.0, 5.0]]);
    for (time_function, end) in [
        (time_function(History::Ramp(0.5)), 0.5),
        (time_function(History::Triangle(triangle)), 3.0),
        (time_function(table), 2.0),
    ] {
        let last = time_function.factor(1e3);
        assert!(
            time_function.changes_after(0.99 * end) && !time_function.changes_after(1.01 * end)
        );
        assert!((time_function.factor(1.01 * end).unwrap() - last.unwrap()).abs() < 1e-12);
    }
    for beta in [1.01, 2.0, 100.0] {
        let pulse = History::Duvall(Duvall { alpha: 10.0, beta: 10.0 * beta });
        let left = pulse.factor(pulse.end());
        assert!((1e-4..1.001e-3).contains(&left), "{beta}: {left}");
    }
    assert!(!TimeFunction::Constant.changes_after(-1.0));
}
