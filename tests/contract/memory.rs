//! Cost of a large model.

use std::time::Instant;

use super::decks::MATTER;
use super::shared::deck;

/// Number from `/proc/self/status` `[B]`.
pub(crate) fn status(name: &str) -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let line = text.lines().find_map(|line| line.strip_prefix(name)).expect("the number");
    let kilobytes: f64 = line.trim_matches([':', ' ', '\t', 'k', 'B']).parse().expect("kB");
    1024.0 * kilobytes
}

/// A million nodes.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "measures its process, in which it must run alone"]
fn million_nodes_are_built_fast_in_little_memory() {
    let deck = deck(&million(0, 0));
    let before = status("VmRSS");
    let clock = Instant::now();
    let model = deck.build().expect("a model");
    let mut simulation = ddem_core::Simulation::new(model);
    let seconds = clock.elapsed().as_secs_f64();
    simulation.step().expect("a step");
    let nodes = simulation.model().n_nodes() as f64;
    let (now, peak) = (status("VmRSS") - before, status("VmHWM") - before);
    let [a, b] = [now, peak].map(|bytes| bytes / nodes);
    println!("{nodes} nodes in {seconds:.2} s, {a:.0} B and at most {b:.0} B a node");
    assert!(nodes == 1e6 && seconds < 10.0, "{seconds} s");
    assert!(peak <= 400.0 * nodes, "{} B a node", peak / nodes);
    assert!(peak <= 2.0 * now, "peak {peak} B, then {now} B");
    // The saved bytes contain the state once, and saving needs no more memory than that.
    std::fs::write("/proc/self/clear_refs", "5").expect("a new peak");
    let before = status("VmRSS");
    let saved = simulation.save().bytes().len() as f64;
    let more = status("VmHWM") - before;
    println!("saved: {:.0} B a node, with {:.0} B of memory", saved / nodes, more / nodes);
    assert!(saved < 52.0 * nodes && more < 1.05 * saved, "{saved} B with {more} B");
}

/// Deck of a million nodes, with probes spread over it and a stage for each excavated shaft.
fn million(probes: usize, shafts: usize) -> String {
    let mut text = format!(
        "{MATTER}
        [[blocks]]
        size = [20.0, 20.0, 20.0]
        count = [20, 20, 20]
        material = 'rock'
        joint = 'seam'
        [[fix]]
        where = {{ z = 0.0 }}
        axes = 'xyz'
        "
    );
    for stage in 0..=shafts {
        text += &format!("[[stage]]\nname = 's{stage}'\nkind = 'dynamic'\nduration = 1e-3\n");
    }
    for shaft in 0..shafts {
        let [x, y] = [shaft % 10 * 2, shaft / 10 * 2];
        let place = format!("x = [{x}.0, {}.0], y = [{y}.0, {}.0], z = [10.0, 20.0]", x + 1, y + 1);
        text += &format!("[[remove]]\nfrom = 's{}'\nwhere = {{ {place} }}\n", shaft + 1);
    }
    for probe in 0..probes {
        let quantity = ["displacement", "velocity", "stress"][probe % 3];
        let at = [17, 131, 613].map(|k| (probe * k % 997) as f64 / 997.0 * 20.0);
        text += &format!(
            "[[probe]]\nname = 'p{probe}'\nat = {at:?}\nquantity = '{quantity}'\nevery = 1e-4\n"
        );
    }
    text
}

/// The same with 1000 probes and 100 excavations.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "measures its process, in which it must run alone"]
fn probes_and_excavations_cost_little_with_a_million_nodes() {
    let build = |probes: usize, shafts: usize| {
        let deck = deck(&million(probes, shafts));
        std::fs::write("/proc/self/clear_refs", "5").expect("a new peak");
        let before = status("VmRSS");
        let clock = Instant::now();
        let session = ddem_io::run::Session::new(&deck, ddem_core::Simd::default());
        let session = session.expect("a model");
        let warnings = session.warnings();
        let (seconds, peak) = (clock.elapsed().as_secs_f64(), status("VmHWM") - before);
        println!("{probes} probes, {shafts} shafts: {seconds:.2} s, {:.0} MB", peak / 1e6);
        println!("{} warnings", warnings.len());
        assert_eq!(session.probes().len(), probes);
        (session, seconds, peak)
    };
    // The first session is kept, so that its memory is not used again.
    let (bare, _, least) = build(0, 0);
    let (full, seconds, peak) = build(1000, 100);
    assert_eq!(bare.simulation().model().n_nodes(), 1_000_000);
    assert_eq!(full.simulation().model().n_nodes(), 1_000_000);
    assert!(seconds < 10.0, "{seconds} s");
    assert!(peak <= 2.0 * least, "{peak} B, and {least} B without probes and excavations");
}
