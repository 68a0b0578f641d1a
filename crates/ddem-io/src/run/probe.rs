//! Probes: what they look at, and their numbers.

use ddem_core::deck::{Probe, Quantity};
use ddem_core::{Fault, Model, Simulation};

/// A probe with its nodes and elements found.
#[derive(Clone, Debug)]
pub(super) struct Sampler {
    pub(super) name: String,
    pub(super) components: &'static [&'static str],
    quantity: Quantity,
    nodes: Vec<u32>,
    /// Block and lattice steps of each element, for stresses.
    elements: Vec<(usize, [usize; 3])>,
    pub(super) every: Option<f64>,
    pub(super) every_steps: u64,
    pub(super) columns: Vec<String>,
}

impl Sampler {
    pub(super) fn new(probe: &Probe, index: usize, model: &Model) -> Result<Self, Fault> {
        let nodes = match (&probe.at, &probe.region) {
            (Some(at), _) => vec![model.nearest_node(*at) as u32],
            (None, Some(region)) => model.nodes_in(region),
            (None, None) => Vec::new(),
        };
        if let Some(region) = probe.region.as_ref().filter(|_| nodes.is_empty()) {
            return Err(model.no_node(format!("probe[{index}].where"), region));
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
            nodes,
            elements,
            every: probe.every,
            every_steps: probe.every_steps.unwrap_or(100),
            columns: components.iter().map(|c| format!("{}.{c}", probe.name)).collect(),
        })
    }

    pub(super) fn sample(&self, simulation: &mut Simulation) -> Vec<f64> {
        match self.quantity {
            Quantity::Reaction => simulation.reaction(&self.nodes).to_vec(),
            Quantity::Displacement => {
                mean(self.nodes.iter().map(|&node| simulation.displacement(node as usize)))
            }
            Quantity::Velocity => {
                mean(self.nodes.iter().map(|&node| simulation.velocity(node as usize)))
            }
            Quantity::Stress => {
                mean(self.elements.iter().map(|&(block, at)| simulation.stress(block, at)))
            }
        }
    }
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

fn mean<const N: usize>(values: impl ExactSizeIterator<Item = [f64; N]>) -> Vec<f64> {
    let count = values.len() as f64;
    let mut sum = [0.0; N];
    for value in values {
        sum.iter_mut().zip(value).for_each(|(sum, x)| *sum += x);
    }
    sum.iter().map(|sum| sum / count).collect()
}
