use crate::deck::History;

#[test]
fn a_ramp_rises_once() {
    let ramp = History::Ramp(2.0);
    let factors = [-1.0, 0.0, 0.5, 1.0, 2.0, 7.0].map(|time| ramp.factor(time));
    assert_eq!(factors, [0.0, 0.0, 0.25, 0.5, 1.0, 1.0]);
}

#[test]
fn a_ramp_of_no_length_is_a_step() {
    let step = History::Ramp(0.0);
    assert_eq!([-1e-9, 0.0, 1e-9, 1.0].map(|time| step.factor(time)), [0.0, 1.0, 1.0, 1.0]);
}

#[test]
fn a_table_is_linear_between_its_rows_and_constant_outside() {
    let table = History::Table(vec![[1.0, -2.0], [2.0, 4.0], [4.0, 0.0]]);
    let factors = [-3.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0].map(|time| table.factor(time));
    assert_eq!(factors, [-2.0, -2.0, 1.0, 4.0, 2.0, 0.0, 0.0]);
    let one = History::Table(vec![[1.0, 3.0]]);
    assert_eq!([0.0, 1.0, 2.0].map(|time| one.factor(time)), [3.0; 3]);
    assert_eq!(History::Table(vec![]).factor(1.0), 0.0);
}
