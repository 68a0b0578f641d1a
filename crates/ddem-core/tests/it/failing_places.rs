//! §7: which overloaded pairs fail at the same equilibrium of a relaxation.

use std::fmt::Write as _;

use ddem_core::{Relaxed, Simulation};

/// Blocks in the row.
const BLOCKS: usize = 10;

/// A row of rigid cubes of 1 m along x, all held but the two that forces along x pull `[N]`. They are
/// blocks of a lattice, or cells of a region if `cut`.
fn row(cut: bool, strengths: &str, forces: [(usize, f64); 2]) -> Simulation {
    let mut text = format!(
        "[materials.rock]\ndensity = 2500.0\nyoung = 2e10\npoisson = 0.25\n\
         [joints.seam]\nthickness = 0.02\nnormal_stiffness = 2e11\nshear_stiffness = 6e10\n{strengths}\n\
         [[stage]]\nname = 'pull'\nkind = 'relax'\n"
    );
    let common = "material = 'rock'\nbody = 'rigid'\n";
    text += &match cut {
        false => format!(
            "[[blocks]]\nsize = [{BLOCKS}, 1, 1]\ncount = [{BLOCKS}, 1, 1]\njoint = 'seam'\n{common}"
        ),
        true => {
            format!("[[region]]\nbox = {{ from = [0, 0, 0], to = [{BLOCKS}, 1, 1] }}\n{common}")
        }
    };
    for x in (1..BLOCKS).filter(|_| cut) {
        let plane = format!("{{ dip = 90, dip_direction = 90, through = [{x}, 0.5, 0.5] }}");
        write!(text, "[[cut]]\nplane = {plane}\njoint = 'seam'\n").expect("a string");
    }
    for block in 0..BLOCKS {
        // Only nodes of this block: those of the next one are a joint away.
        let nodes = format!("{{ x = [{block}.001, {block}.999] }}");
        match forces.iter().find(|(pulled, _)| *pulled == block) {
            Some((_, force)) => {
                write!(text, "[[load]]\nwhere = {nodes}\nforce = [{force:?}, 0, 0]\n")
            }
            None => write!(text, "[[fix]]\nwhere = {nodes}\naxes = 'xyz'\n"),
        }
        .expect("a string");
    }
    let deck = ddem_deck::parse(&text, "row.toml").unwrap_or_else(|error| panic!("{error}")).0;
    Simulation::new(deck.build().unwrap_or_else(|error| panic!("{error}")))
}

/// Numbers of joints of which all pairs have failed after each equilibrium in which pairs fail.
fn failures(mut simulation: Simulation) -> Vec<u64> {
    let pairs = simulation.model().n_pairs() as u64 / (BLOCKS as u64 - 1);
    let mut failures = Vec::new();
    for _ in 0..5000 {
        let relaxed = simulation.relax_step(1e-6).unwrap_or_else(|error| panic!("{error}"));
        let failed: u64 = simulation.failed_pairs().iter().sum();
        assert_eq!(failed % pairs, 0, "only a part of a joint has failed");
        if failures.last().unwrap_or(&0) != &(failed / pairs) {
            failures.push(failed / pairs);
        }
        if relaxed == Relaxed::Done {
            return failures;
        }
    }
    panic!("no equilibrium after {failures:?}");
}

const COHESIVE: &str = "cohesion = 1e6\nfriction = 30.0\ntension = 1e5";

/// Half of each force pulls the joint behind its block, to 1.5 and 1.25 times its strength.
fn pulled(cut: bool, strengths: &str, blocks: [usize; 2]) -> Vec<u64> {
    let [first, second] = blocks;
    failures(row(cut, strengths, [(first, 3e5), (second, 2.5e5)]))
}

#[test]
fn less_loaded_pair_beside_waits_for_another_equilibrium() {
    for cut in [false, true] {
        // One held block is between the two, and beside both.
        assert_eq!(pulled(cut, COHESIVE, [2, 4]), [1, 2], "cut: {cut}");
        assert_eq!(pulled(cut, COHESIVE, [4, 2]), [1, 2], "cut: {cut}");
    }
}

/// The joint beside has 1.4 times its strength. A failure relieves the joints of other blocks less.
#[test]
fn almost_as_loaded_pair_beside_does_not_wait() {
    for cut in [false, true] {
        assert_eq!(failures(row(cut, COHESIVE, [(2, 3e5), (4, 2.8e5)])), [2], "cut: {cut}");
    }
}

#[test]
fn pairs_far_apart_fail_at_one_equilibrium() {
    for cut in [false, true] {
        // Two blocks between, then four: no block is beside both.
        assert_eq!(pulled(cut, COHESIVE, [2, 5]), [2], "cut: {cut}");
        assert_eq!(pulled(cut, COHESIVE, [2, 7]), [2], "cut: {cut}");
    }
}

/// Joints with friction alone part without a loss of strength.
#[test]
fn pairs_that_shed_no_load_do_not_wait() {
    for cut in [false, true] {
        assert_eq!(pulled(cut, "friction = 30.0", [2, 4]), [2], "cut: {cut}");
    }
}
