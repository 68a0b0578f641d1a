//! Report of `--check`.

use std::fmt;

use ddem_core::{ChargeSize, ErrorCode, Fault, Model, ModelError, Simulation};
use ddem_deck::lint::Diagnostic;
use ddem_deck::{
    BuildPhase, BuildProgress, BuiltDeck, Deck, DeckError, Interface, Selection, Size, Source,
    Stage, StageKind,
};

use super::RunFailure;
use super::cell_step::CellStep;
use super::given_steps::{check_all_steps, unsafe_steps};
use super::plan::{Plan, estimate, plans};
use super::probe::Sampler;
use crate::summary::{AddedInertia, TimeStepLimit, WorstElement};

/// Size of a model and estimates of its run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Title of the deck.
    pub title: String,
    /// Blocks.
    pub blocks: u64,
    /// Nodes.
    pub nodes: u64,
    /// Hex8 elements of the blocks.
    pub elements: u64,
    /// Joint faces between two blocks.
    pub joints: u64,
    /// Pairs of facing nodes.
    pub pairs: u64,
    /// Joint faces that can fail.
    pub breakable_joints: u64,
    /// Pairs of facing nodes that can fail.
    pub breakable_pairs: u64,
    /// Pairs of blocks without a joint that are near each other at the start; `None` if contacts
    /// are not searched for.
    pub near: Option<u64>,
    /// Sets that touch, with the joint that joins them, if there is one.
    pub interfaces: Vec<Interface>,
    /// Critical time step `[s]`; NaN if no stage needs it.
    pub critical_step: f64,
    /// Part of the model that limits it.
    pub limit: Option<TimeStepLimit>,
    /// Blocks of regions with the shortest critical steps, the shortest first, if one of them limits the step.
    pub shortest_steps: Vec<CellStep>,
    /// Inertia that thin cells add to regions.
    pub added_inertia: Vec<AddedInertia>,
    /// Most distorted element of cells and slanted blocks.
    pub worst_element: Option<WorstElement>,
    /// Memory that a run needs `[bytes]`.
    pub bytes: u64,
    /// Size of each charge before it detonates.
    pub charges: Vec<ChargeSize>,
    /// Blocks that curved and slanted shapes have selected.
    pub selections: Vec<Selection>,
    /// Estimate of each stage.
    pub stages: Vec<Plan>,
    /// Warnings.
    pub warnings: Vec<Diagnostic>,
}

/// Number of bytes as text.
pub(crate) fn bytes(n: u64) -> String {
    let (mut value, mut unit) = (n as f64, "B");
    for next in ["kB", "MB", "GB", "TB", "PB", "EB"] {
        if value < 1000.0 {
            break;
        }
        (value, unit) = (value / 1000.0, next);
    }
    if unit == "B" { format!("{n} B") } else { format!("{value:.1} {unit}") }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.title.is_empty() {
            writeln!(f, "{}", self.title)?;
        }
        writeln!(f, "blocks         {}", self.blocks)?;
        writeln!(f, "nodes          {}", self.nodes)?;
        writeln!(f, "elements       {}", self.elements)?;
        writeln!(f, "joints         {}", self.joints)?;
        writeln!(f, "pairs          {}", self.pairs)?;
        if self.breakable_joints > 0 {
            let (joints, pairs) = (self.breakable_joints, self.breakable_pairs);
            writeln!(f, "can fail       {joints} joints, {pairs} pairs")?;
        }
        if let Some(near) = self.near {
            writeln!(f, "contacts       {near} pairs of blocks near each other at the start")?;
        }
        for interface in &self.interfaces {
            let what = if interface.joint.is_some() { "joined" } else { "touching" };
            writeln!(f, "{what:<15}{interface}")?;
        }
        if self.critical_step.is_finite() {
            writeln!(f, "critical step  {:.6e} s", self.critical_step)?;
        }
        if let Some(limit) = &self.limit {
            writeln!(f, "limited by     {limit}")?;
        }
        if !self.shortest_steps.is_empty() {
            writeln!(f, "shortest steps {}", CellStep::HEAD)?;
        }
        for cell in &self.shortest_steps {
            writeln!(f, "{:<15}{cell}", "")?;
        }
        if let Some(worst) = &self.worst_element {
            writeln!(f, "worst element  {worst}")?;
        }
        for added in &self.added_inertia {
            writeln!(f, "added inertia  {added}")?;
        }
        writeln!(f, "memory         {}", bytes(self.bytes))?;
        for (index, charge) in self.charges.iter().enumerate() {
            writeln!(f, "{:<15}{charge}", format!("charge {index}"))?;
        }
        for selection in &self.selections {
            writeln!(f, "selected       {selection}")?;
        }
        for stage in &self.stages {
            let holds = if self.breakable_pairs > 0 { " while joints hold" } else { "" };
            writeln!(f, "{stage}{holds}")?;
        }
        Ok(())
    }
}

/// Builds the model of a deck and reports its size and the estimates of its run; nothing is
/// written.
///
/// # Errors
///
/// The deck has mistakes, or its model does not fit in memory.
pub fn inspect(deck: &Deck, source: &Source) -> Result<Report, RunFailure> {
    inspect_with_progress(deck, source, &BuildProgress::default())
}

/// As [`inspect`], with the progress for other threads.
///
/// # Errors
///
/// Those of [`inspect`].
pub fn inspect_with_progress(
    deck: &Deck,
    source: &Source,
    progress: &BuildProgress,
) -> Result<Report, RunFailure> {
    let Built { site, model, samplers } = prepare(deck, source, available_memory(), progress)?;
    let mut simulation = Simulation::new(model);
    progress.enter(BuildPhase::Report);
    check_all_steps(&mut simulation, deck).map_err(|failure| located(failure, source))?;
    let mut report = report(&site, &mut simulation, &samplers);
    report.critical_step = simulation.critical_step().unwrap_or(f64::NAN);
    report.limit = limit(&mut simulation, deck);
    if let Some(limit) = &report.limit {
        // Nothing stops this simulation.
        report.shortest_steps = CellStep::shortest(&mut simulation, limit).unwrap_or_default();
    }
    estimate(&mut simulation, &deck.stage, &mut report.stages);
    Ok(report)
}

/// Model of a deck that will be run, with its probes; every fault is located in the deck.
pub(super) fn prepare(
    deck: &Deck,
    source: &Source,
    available: u64,
    progress: &BuildProgress,
) -> Result<Built, RunFailure> {
    // Mistakes in existing tables are reported first.
    if deck.stage.is_empty() && ddem_deck::check(deck).is_empty() {
        let fault = Fault::new(ErrorCode::EmptyModel, "stage", "the model has no stage")
            .help("add a `[[stage]]` with `kind = \"relax\"` or `kind = \"dynamic\"`");
        return Err(located(ModelError::from(fault).into(), source));
    }
    let built = build(deck, available, progress).and_then(|built| {
        let safety = deck.stage.iter().position(|stage| stage.kind == StageKind::Safety);
        match safety.and_then(|at| built.model.without_strength(&format!("stage[{at}].kind"))) {
            Some(fault) => Err(ModelError::from(fault).into()),
            None => Ok(built),
        }
    });
    built.map_err(|failure| located(failure, source))
}

/// Failure whose faults of a model are located in the text of its deck.
pub(super) fn located(failure: RunFailure, source: &Source) -> RunFailure {
    match failure {
        RunFailure::Model(error) => DeckError::from_faults(source, error.faults).into(),
        failure => failure,
    }
}

/// Checks that a model fits in memory.
fn refuse(size: Size, available: u64) -> Result<(), RunFailure> {
    if size.bytes <= available as f64 {
        return Ok(());
    }
    Err(RunFailure::Memory {
        needed: size.bytes as u64,
        available,
        blocks: size.blocks as u64,
        nodes: size.nodes as u64,
    })
}

/// Memory of the program itself, of its threads and of the buffers of its files `[bytes]`.
const PROGRAM: f64 = 50e6;

/// Size of a run of a built model, including refinement.
fn grown(size: Size, model: &Model) -> Size {
    let (blocks, nodes) = (model.n_blocks() as f64, model.n_nodes() as f64);
    let mut grown = if size.nodes == 0.0 {
        let [elements, pairs] =
            [model.n_elements(), model.n_nonconforming_pairs()].map(|count| count as f64);
        Size::of_parts(blocks, nodes, elements, pairs)
    } else {
        let bytes = (nodes / size.nodes).max(1.0) * size.bytes;
        Size { blocks: blocks.max(size.blocks), nodes: nodes.max(size.nodes), bytes }
    };
    grown.bytes += PROGRAM;
    grown
}

/// A deck with its blocks cut, its model and its probes.
pub(super) struct Built {
    pub(super) site: BuiltDeck,
    pub(super) model: Model,
    pub(super) samplers: Vec<Sampler>,
}

/// The model of a deck and its probes.
pub(super) fn build(
    deck: &Deck,
    available: u64,
    progress: &BuildProgress,
) -> Result<Built, RunFailure> {
    let faults = ddem_deck::check(deck);
    if !faults.is_empty() {
        return Err(ModelError { faults }.into());
    }
    let size = Size::of(deck);
    refuse(size, available)?;
    if let Some(fault) = deck.beyond_memory(available)? {
        return Err(ModelError::from(fault).into());
    }
    let site = BuiltDeck::within(deck, available, progress)?;
    progress.enter(BuildPhase::Model);
    let model = site.model();
    refuse(grown(size, &model), available)?;
    let probes = deck.probe.iter().enumerate();
    let (samplers, faults): (Vec<_>, Vec<_>) =
        probes.map(|probe| Sampler::new(probe, deck, &model)).partition(Result::is_ok);
    let faults: Vec<Fault> = faults.into_iter().filter_map(Result::err).collect();
    if !faults.is_empty() {
        return Err(ModelError { faults }.into());
    }
    Ok(Built { site, model, samplers: samplers.into_iter().flatten().collect() })
}

/// Size, critical step and stages of a model.
pub(super) fn report(
    site: &BuiltDeck,
    simulation: &mut Simulation,
    samplers: &[Sampler],
) -> Report {
    let deck = site.deck();
    let moves = |stage: &Stage| stage.kind == StageKind::Dynamic;
    let dynamic = deck.stage.iter().any(moves);
    // For a large model this takes seconds.
    let critical_step = match dynamic {
        true => simulation.critical_step().unwrap_or(f64::NAN),
        false => f64::NAN,
    };
    let mut warnings = site.warnings(simulation.model());
    warnings.extend(samplers.iter().filter_map(|sampler| sampler.warning.clone()));
    warnings.extend(unsafe_steps(deck, simulation, &deck.stage));
    warnings.retain(|warning| deck.reports(warning));
    let plans = plans(simulation, &deck.stage);
    let near = simulation.contact_counts().near as u64;
    let model = simulation.model();
    let [breakable_joints, breakable_pairs] = model.n_breakable().map(|count| count as u64);
    Report {
        title: deck.title.clone(),
        blocks: model.n_whole_blocks() as u64,
        nodes: model.n_nodes() as u64,
        elements: model.n_elements() as u64,
        joints: model.n_whole_joints() as u64,
        pairs: model.n_pairs() as u64,
        breakable_joints,
        breakable_pairs,
        near: model.can_meet().then_some(near),
        critical_step,
        limit: None,
        shortest_steps: Vec::new(),
        added_inertia: AddedInertia::of_regions(site, model),
        worst_element: WorstElement::new(model),
        bytes: grown(Size::of(deck), model).bytes as u64,
        charges: model.charges(),
        interfaces: site.interfaces(),
        selections: site.selections(),
        stages: plans,
        warnings,
    }
}

/// Part of a model that limits the time step of a stage that would begin now; `None` if the observer
/// stops the search.
pub(super) fn limit(simulation: &mut Simulation, deck: &Deck) -> Option<TimeStepLimit> {
    let limit = simulation.step_limit().ok()??;
    Some(TimeStepLimit::new(limit, simulation.model(), deck))
}

/// Memory that this process can still allocate `[bytes]`.
pub(super) fn available_memory() -> u64 {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let limit = system.cgroup_limits().map_or(u64::MAX, |limits| limits.free_memory);
    match system.available_memory() {
        // Unknown on this system; the allocator fails if there is not enough.
        0 => u64::MAX,
        available => available.min(limit),
    }
}
