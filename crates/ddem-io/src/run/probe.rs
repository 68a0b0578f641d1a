//! Probes: what they look at, and their numbers.

use ddem_core::{Fault, Model, Simulation};
use ddem_deck::{Deck, Probe, Quantity};

/// A probe with its nodes and elements found.
#[derive(Clone, Debug)]
pub(super) struct Sampler {
    pub(super) name: String,
    pub(super) components: &'static [&'static str],
    quantity: Quantity,
    nodes: Vec<u32>,
    /// Block and lattice steps of each element, for stresses.
    elements: Vec<(usize, [usize; 3])>,
    /// What is allowed but perhaps not meant.
    pub(super) doubt: Option<String>,
    pub(super) every: Option<f64>,
    pub(super) every_steps: u64,
    pub(super) columns: Vec<String>,
}

impl Sampler {
    pub(super) fn new(
        (index, probe): (usize, &Probe),
        deck: &Deck,
        model: &Model,
    ) -> Result<Self, Fault> {
        let nodes = match (&probe.at, &probe.region) {
            (Some(at), _) => vec![model.nearest_node(*at) as u32],
            (None, Some(region)) => region.nodes(model).map_err(|mut fault| {
                fault.place = format!("probe[{index}].{}", fault.place);
                fault
            })?,
            (None, None) => Vec::new(),
        };
        if let Some(region) = probe.region.as_ref().filter(|_| nodes.is_empty()) {
            return Err(region.no_node(model, format!("probe[{index}].where")));
        }
        let elements = match (probe.quantity, probe.at) {
            (Quantity::Stress, Some(at)) => vec![model.element_at(at)],
            (Quantity::Stress, None) => model.elements_at(&nodes),
            _ => Vec::new(),
        };
        stress_is_there(index, &elements, model)?;
        let components: &'static [&'static str] = match probe.quantity {
            Quantity::Stress => &["xx", "yy", "zz", "xy", "yz", "zx"],
            _ => &["x", "y", "z"],
        };
        Ok(Self {
            name: probe.name.clone(),
            components,
            quantity: probe.quantity,
            doubt: goes(probe, (&nodes, &elements), (deck, model)),
            nodes,
            elements,
            every: probe.every,
            every_steps: probe.every_steps.unwrap_or(100),
            columns: components.iter().map(|c| format!("{}.{c}", probe.name)).collect(),
        })
    }

    /// Its numbers now: means over what is there, and none where nothing is left.
    pub(super) fn sample(&self, simulation: &mut Simulation) -> Vec<f64> {
        let model = simulation.model();
        let there = |&node: &u32| !model.is_removed(model.block_of(node as usize));
        match self.quantity {
            Quantity::Reaction => simulation.reaction(&self.nodes).to_vec(),
            Quantity::Displacement => {
                let nodes = self.nodes.iter().filter(|node| there(node));
                mean(nodes.map(|&node| simulation.displacement(node as usize)))
            }
            Quantity::Velocity => {
                let nodes: Vec<u32> = self.nodes.iter().copied().filter(there).collect();
                mean(nodes.into_iter().map(|node| simulation.velocity(node as usize)))
            }
            Quantity::Stress => {
                let there = |(block, _): &(usize, _)| !model.is_removed(*block);
                let elements: Vec<_> = self.elements.iter().copied().filter(there).collect();
                mean(elements.into_iter().map(|(block, at)| simulation.stress(block, at)))
            }
        }
    }
}

/// What is said of a probe that has nothing left to look at from some stage on. Of supports it has: their
/// sum is 0.
fn goes(
    probe: &Probe,
    (nodes, elements): (&[u32], &[(usize, [usize; 3])]),
    (deck, model): (&Deck, &Model),
) -> Option<String> {
    let mut blocks: Vec<usize> = match probe.quantity {
        Quantity::Reaction => return None,
        Quantity::Stress => elements.iter().map(|&(block, _)| block).collect(),
        _ => nodes.iter().map(|&node| model.block_of(node as usize)).collect(),
    };
    blocks.dedup();
    let stages: Option<Vec<usize>> = blocks.iter().map(|&block| model.removed_in(block)).collect();
    let last = stages?.into_iter().max()?;
    let stage = &deck.stage.get(last)?.name;
    Some(format!(
        "probe `{}` looks at blocks that are taken out by stage `{stage}`: it has no values from then on",
        probe.name
    ))
}

/// Rigid blocks have none.
fn stress_is_there(
    index: usize,
    elements: &[(usize, [usize; 3])],
    model: &Model,
) -> Result<(), Fault> {
    let mut blocks = elements.iter().map(|&(block, _)| block);
    let Some(block) = blocks.find(|&block| model.is_rigid(block)) else { return Ok(()) };
    let message = format!("block {block} is rigid: it has no stress");
    Err(Fault::new(format!("probe[{index}].quantity"), message).help(
        "only blocks with `body = \"deformable\"` have stresses; `set` in `where` selects those \
         of one set",
    ))
}

/// Not a number where there is nothing.
fn mean<const N: usize>(values: impl Iterator<Item = [f64; N]>) -> Vec<f64> {
    let (mut sum, mut count) = ([0.0; N], 0.0);
    for value in values {
        sum.iter_mut().zip(value).for_each(|(sum, x)| *sum += x);
        count += 1.0;
    }
    sum.iter().map(|sum| sum / count).collect()
}
