//! Probes: their nodes or elements, and their values.

use ddem_core::{ErrorCode, Fault, Field, FieldLocation, Model, Simulation};
use ddem_deck::lint::{Code, Diagnostic};
use ddem_deck::{Deck, Probe, Quantity};

/// A probe with its nodes or elements.
#[derive(Clone, Debug)]
pub(super) struct Sampler {
    pub(super) name: String,
    pub(super) components: &'static [&'static str],
    /// Recorded field; `None` for reactions.
    field: Option<&'static Field>,
    /// Nodes or elements by their numbers, with their blocks.
    values: Vec<Value>,
    /// Warning about removed blocks, if there is one.
    pub(super) warning: Option<Diagnostic>,
    pub(super) every: Option<f64>,
    pub(super) every_steps: u64,
    pub(super) columns: Vec<String>,
}

/// A node or an element.
#[derive(Clone, Copy, Debug)]
struct Value {
    block: usize,
    number: usize,
    /// Part of it in a mean: tied nodes, which are at one place, count as one.
    weight: f64,
}

impl Sampler {
    pub(super) fn new(
        (index, probe): (usize, &Probe),
        deck: &Deck,
        model: &Model,
    ) -> Result<Self, Fault> {
        let nodes: Vec<u32> = match (&probe.at, &probe.r#where) {
            (Some(at), _) => vec![model.nearest_node(*at) as u32],
            (None, Some(selector)) => selector.nodes(model).map_err(|mut fault| {
                fault.place = format!("probe[{index}].{}", fault.place);
                fault
            })?,
            (None, None) => Vec::new(),
        };
        if let Some(selector) = probe.r#where.as_ref().filter(|_| nodes.is_empty()) {
            return Err(selector.no_node(model, format!("probe[{index}].where")));
        }
        let field = field(probe.quantity, index, model)?;
        let values: Vec<Value> = match (field.map(|field| field.on), probe.at) {
            (Some(FieldLocation::Element), at) => {
                let elements = at.map(|at| vec![model.element_at(at)]);
                let elements = elements.unwrap_or_else(|| model.elements_at(&nodes)).into_iter();
                let number =
                    |(block, at)| Value { block, number: model.element(block, at), weight: 1.0 };
                elements.map(number).collect()
            }
            _ => {
                let value = |&node: &u32| {
                    let tied = model.geometry().ties.with(node).iter();
                    let chosen = tied.filter(|node| nodes.binary_search(node).is_ok()).count();
                    let number = node as usize;
                    let weight = 1.0 / chosen.max(1) as f64;
                    Value { block: model.block_of(number), number, weight }
                };
                nodes.iter().map(value).collect()
            }
        };
        if field.is_some_and(|field| field.unit == "Pa") {
            stress_is_there(index, &values, model)?;
        }
        let components: &'static [&'static str] = match field {
            Some(Field { components: 1, name, .. }) => std::slice::from_ref(name),
            Some(Field { components: 6, .. }) => &["xx", "yy", "zz", "xy", "yz", "zx"],
            _ => &["x", "y", "z"],
        };
        let warning = field.and_then(|_| removed((index, probe), &values, (deck, model)));
        Ok(Self {
            name: probe.name.clone(),
            components,
            field,
            values,
            warning,
            every: probe.every,
            every_steps: probe.every_steps(),
            columns: components.iter().map(|c| format!("{}.{c}", probe.name)).collect(),
        })
    }

    /// Present values: the sum of reactions, or the mean of a field over the remaining blocks; NaN
    /// if none is left.
    pub(super) fn sample(&self, simulation: &mut Simulation) -> Vec<f64> {
        let Some(field) = self.field else {
            let nodes: Vec<u32> = self.values.iter().map(|node| node.number as u32).collect();
            return simulation.reaction(&nodes).to_vec();
        };
        let snapshot = simulation.snapshot();
        let mut numbers = vec![0.0; field.components];
        let (mut sum, mut count) = (numbers.clone(), 0.0);
        for &Value { block, number, weight } in &self.values {
            if !snapshot.model().is_removed(block) {
                snapshot.fill(field, number..number + 1, &mut numbers);
                sum.iter_mut().zip(&numbers).for_each(|(sum, x)| *sum += x * weight);
                count += weight;
            }
        }
        // The mean is NaN if no block is left.
        sum.iter().map(|sum| sum / count).collect()
    }
}

/// Output field of a quantity; `None` for reactions.
fn field(quantity: Quantity, index: usize, model: &Model) -> Result<Option<&'static Field>, Fault> {
    let Some(name) = quantity.field() else { return Ok(None) };
    let found = ddem_core::fields(model)
        .find(|field| field.name == name && field.on != FieldLocation::Pair);
    found.map(Some).ok_or_else(|| {
        let message = format!("there is no `{name}`: the model keeps no peaks");
        Fault::new(ErrorCode::MissingKey, format!("probe[{index}].quantity"), message)
            .help("`peaks = true` in `[model]` keeps them from the start of the run on")
    })
}

/// Warning about a probe that has nothing to record from some stage on. Reactions are exempt: without supports their
/// sum is 0.
fn removed(
    (index, probe): (usize, &Probe),
    values: &[Value],
    (deck, model): (&Deck, &Model),
) -> Option<Diagnostic> {
    let mut blocks: Vec<usize> = values.iter().map(|value| value.block).collect();
    blocks.dedup();
    let stages: Option<Vec<usize>> = blocks.iter().map(|&block| model.removed_in(block)).collect();
    let last = stages?.into_iter().max()?;
    let stage = &deck.stage.get(last)?.name;
    let message = format!(
        "all blocks of probe `{}` are removed by stage `{stage}`: it has no values from then on",
        probe.name
    );
    let at = format!("probe[{index}]");
    let help = "choose blocks that stay, unless only the values before that matter";
    Some(Diagnostic::warning(Code::ProbeOfRemovedBlocks, at, message, help))
}

/// Checks that no element belongs to a rigid block, which has no stress.
fn stress_is_there(index: usize, elements: &[Value], model: &Model) -> Result<(), Fault> {
    let mut blocks = elements.iter().map(|element| element.block);
    let Some(block) = blocks.find(|&block| model.is_rigid(block)) else { return Ok(()) };
    let message = format!("block {} is rigid: it has no stress", model.whole_block(block));
    Err(Fault::new(ErrorCode::NotSupported, format!("probe[{index}].quantity"), message).help(
        "only blocks with `body = \"deformable\"` have stresses; `set` in `where` selects those \
         of one set",
    ))
}
