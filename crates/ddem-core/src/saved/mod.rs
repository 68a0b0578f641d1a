//! A simulation as plain numbers, to be written and read back bit for bit.

mod contacts;
mod pairs;
mod peaks;
mod watch;

use std::collections::BTreeMap;

use nalgebra::{Quaternion, UnitQuaternion};

use crate::charge::Fill;
use crate::conditions::{Applied, Released};
use crate::geometry::Vec3;
use crate::lanes::LANES;
use crate::model::Model;
use crate::motion::Motion;
use crate::rigid::Pose;
use crate::simd::Simd;
use crate::simulation::Simulation;
use crate::stage::Damping;
use crate::state::{Fresh, Memory, State, Work};

/// More steps than any run takes: what is beyond is no count of steps.
const MOST_STEPS: u64 = 1 << 53;

/// Everything that a simulation needs to go on, without the model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Saved {
    /// Arrays of numbers by name.
    pub arrays: BTreeMap<String, Vec<f64>>,
    /// Whole numbers by name.
    pub counters: BTreeMap<String, u64>,
}

impl Simulation {
    /// The present state.
    #[must_use]
    pub fn save(&self) -> Saved {
        let State {
            time,
            origin,
            end,
            last_step,
            automatic,
            steps,
            stage,
            fresh,
            stage_starts,
            u,
            v,
            poses,
            before,
            breaks,
            contacts,
            failed,
            work,
            load_factors,
            applied,
            kept,
            released,
            columns,
            fills,
            way,
            peaks,
            watch,
        } = &*self.state;
        let mut saved = Saved::default();
        let mut put = |name: &str, values: Vec<f64>| saved.arrays.insert(name.to_owned(), values);
        put("displacement", self.model.plain(u).into_flattened());
        put("velocity", self.model.plain(v).into_flattened());
        put("poses", poses.iter().flatten().flat_map(numbers).collect());
        put("stage_starts", stage_starts.clone());
        put("load_factors", load_factors.clone());
        let nodes = applied.keys().map(|&node| f64::from(node)).collect();
        put("applied_nodes", nodes);
        put("applied_forces", applied.values().flatten().copied().collect());
        put("kept_nodes", kept.keys().map(|&node| f64::from(node)).collect());
        put("kept_forces", kept.values().flatten().copied().collect());
        for (load, Released { began, forces }) in released {
            let nodes = forces.keys().map(|&node| f64::from(node)).collect();
            put(&format!("released_{load}_nodes"), nodes);
            put(&format!("released_{load}_forces"), forces.values().flatten().copied().collect());
            put(&format!("released_{load}"), vec![*began]);
        }
        put("columns", columns.iter().flatten().flatten().copied().collect());
        let row = |volume: Option<f64>| [f64::from(volume.is_some()), volume.unwrap_or(0.0)];
        put(
            "gas",
            fills.iter().flat_map(|fill| [row(fill.began), row(fill.left)]).flatten().collect(),
        );
        put("way", vec![*way]);
        put("damping", vec![damping_number(self.damping)]);
        let Work { loads, supports, damping, friction, fracture, contact, most } = *work;
        put("work", vec![loads, supports, damping, friction, fracture, contact, most]);
        let initial = self.initial_energy;
        let [critical, broken] = self.critical_steps.map(|step| step.unwrap_or(0.0));
        let step = self.motion.time_step;
        put("time", vec![*time, origin.0, *end, *before, step, critical, broken, initial]);
        let counters = &mut saved.counters;
        let mut count = |name: &str, value: u64| counters.insert(name.to_owned(), value);
        count("steps", *steps);
        count("failed_shear", failed[0]);
        count("failed_tension", failed[1]);
        count("origin_step", origin.1);
        count("damping", damping_kind(self.damping));
        count("stage", *stage as u64);
        if let Some(Fresh { left, first }) = fresh {
            count("fresh_left", *left as u64);
            count("fresh_first", *first as u64);
        }
        count("last_step", *last_step);
        count("automatic", u64::from(*automatic));
        count("started", u64::from(self.started));
        count("resting", u64::from(self.motion.fictitious && self.relaxation.is_none()));
        if let Some(relaxation) = &self.relaxation {
            let memory = &relaxation.memory;
            count("relax_increments", memory.increments);
            count("relax_increment", memory.increment);
            count("relax_left", memory.left as u64);
            if let Some(driven) = memory.driven {
                count("relax_driven", driven as u64);
            }
            count("relax_since_restart", memory.since_restart);
            count("relax_looked", u64::from(memory.looked));
            count("relax_turned", u64::from(memory.turned));
            count("relax_rounded", memory.rounded);
            let mut put = |name: &str, v: Vec<f64>| saved.arrays.insert(name.to_owned(), v);
            put("relax_from", memory.from.clone());
            put("relax_to", memory.to.clone());
            put("relax_way", vec![memory.way, memory.first, memory.least, memory.most]);
            put("relax_last", memory.last.iter().copied().collect());
        }
        pairs::save(&self.model, breaks, &mut saved);
        contacts::save(contacts, &mut saved);
        peaks::save(&self.model, peaks, &mut saved);
        watch::save(watch, &mut saved);
        saved
    }

    /// A simulation that goes on from a saved state, bit for bit. `None` when the numbers are not
    /// those of this model.
    #[must_use]
    pub fn restore(model: Model, simd: Simd, saved: &Saved) -> Option<Self> {
        let array = |name: &str| saved.arrays.get(name).map(Vec::as_slice);
        let count = |name: &str| saved.counters.get(name).copied();
        let n = 3 * model.n_nodes();
        let (u, v) = (array("displacement")?, array("velocity")?);
        let (
            &[time, origin, end, before, time_step, critical, broken, initial],
            &[loads, supports, damped, friction, fracture, contact, most],
        ) = (array("time")?, array("work")?)
        else {
            return None;
        };
        if !saved.fits(&model)? {
            return None;
        }
        let stage = usize::try_from(count("stage")?).ok()?;
        let damping = damping(count("damping")?, *array("damping")?.first()?)?;
        let mut model = model;
        if !model.steps(0, stage).is_empty() {
            model.excavate(model.back(stage, stage));
        }
        let mut fading = BTreeMap::new();
        for load in model.fading(0, stage) {
            let released = released(saved, load, n / 3)?;
            model.set_released(load, &released);
            fading.insert(load, released);
        }
        let mut simulation = Self::with_simd(model, simd);
        let state = &mut simulation.state;
        for node in 0..n / 3 {
            let at = |field: &[f64]| [field[3 * node], field[3 * node + 1], field[3 * node + 2]];
            simulation.model.set(&mut state.u, node, at(u));
            simulation.model.set(&mut state.v, node, at(v));
        }
        (state.time, state.steps) = (time, count("steps")?);
        state.stage = stage;
        let number = |name: &str| count(name).and_then(|number| usize::try_from(number).ok());
        let fresh = number("fresh_left").zip(number("fresh_first"));
        state.fresh = fresh.map(|(left, first)| Fresh { left, first });
        state.origin = (origin, count("origin_step")?);
        state.stage_starts = array("stage_starts")?.to_vec();
        state.load_factors = array("load_factors")?.to_vec();
        state.way = *array("way")?.first()?;
        state.before = before;
        (state.end, state.automatic) = (end, count("automatic")? == 1);
        state.last_step = count("last_step")?;
        state.work = Work { loads, supports, damping: damped, friction, fracture, contact, most };
        state.failed = [count("failed_shear")?, count("failed_tension")?];
        state.contacts = contacts::restore(&simulation.model, saved)?;
        state.breaks = pairs::restore(&simulation.model, saved, &state.contacts)?;
        peaks::restore(&simulation.model, saved, &mut state.peaks)?;
        state.released = fading;
        state.applied = applied(array("applied_nodes")?, array("applied_forces")?, n / 3)?;
        state.kept = applied(array("kept_nodes")?, array("kept_forces")?, n / 3)?;
        let (fills, rest) = array("gas")?.as_chunks::<4>();
        if !rest.is_empty() || fills.len() != state.fills.len() {
            return None;
        }
        let volume = |known: f64, volume: f64| (known != 0.0).then_some(volume);
        for (fill, &[a, began, b, left]) in state.fills.iter_mut().zip(fills) {
            *fill = Fill { began: volume(a, began), left: volume(b, left) };
        }
        let (columns, rest) = array("columns")?.as_chunks::<6>();
        if !rest.is_empty() || columns.len() != state.columns.len() {
            return None;
        }
        for (column, &[a, b, c, d, e, f]) in state.columns.iter_mut().zip(columns) {
            *column = [Vec3::new(a, b, c), Vec3::new(d, e, f)];
        }
        let (poses, rest) = array("poses")?.as_chunks::<POSE>();
        if !rest.is_empty() || poses.len() != LANES * simulation.model.packs.rigid {
            return None;
        }
        let diverged = !u.iter().chain(v).all(|x| x.is_finite());
        let known = simulation.state.poses.iter_mut().flatten();
        for (known, numbers) in known.zip(poses) {
            *known = Some(pose(numbers)).filter(|pose| diverged || is_sound(pose))?;
        }
        simulation.scratch.fit(&simulation.model, &simulation.state);
        simulation.view.renew(&simulation.model, &simulation.state);
        simulation.critical_steps = [critical, broken].map(|step| (step > 0.0).then_some(step));
        simulation.started = count("started")? == 1;
        let assembly = &simulation.model.assembly;
        *simulation.motion = Motion::dynamic(assembly, damping, before, time_step);
        simulation.damping = damping;
        if count("resting") == Some(1) {
            simulation.rest();
        }
        if let Some(increments) = count("relax_increments") {
            simulation.continue_relaxation(Memory {
                increments,
                increment: count("relax_increment")?,
                left: number("relax_left")?,
                driven: number("relax_driven"),
                since_restart: count("relax_since_restart")?,
                looked: count("relax_looked")? == 1,
                turned: count("relax_turned")? == 1,
                rounded: count("relax_rounded")?,
                from: array("relax_from")?.to_vec(),
                to: array("relax_to")?.to_vec(),
                way: *array("relax_way")?.first()?,
                first: *array("relax_way")?.get(1)?,
                least: *array("relax_way")?.get(2)?,
                most: *array("relax_way")?.get(3)?,
                last: array("relax_last")?.iter().copied().collect(),
            });
        }
        simulation.initial_energy = initial;
        simulation.state.watch = watch::restore(saved)?;
        Some(simulation)
    }
}

impl Saved {
    /// Whether the numbers can be those of a model; `None` when some are not there. Displacements and
    /// velocities may be anything: a run that has diverged may be looked at.
    fn fits(&self, model: &Model) -> Option<bool> {
        let array = |name: &str| self.arrays.get(name).map(Vec::as_slice);
        let count = |name: &str| self.counters.get(name).copied();
        let n = 3 * model.n_nodes();
        let fields = ["displacement", "velocity"];
        let fields = fields.iter().all(|name| array(name).is_some_and(|field| field.len() == n));
        let factors = ["load_factors", "relax_from", "relax_to"].iter();
        let factors = factors.map(|name| array(name)).all(|factors| {
            factors.is_none_or(|factors| factors.len() == model.conditions.n_factors())
        });
        let &[time, _, _, before, time_step, _, _, initial] = array("time")? else {
            return Some(false);
        };
        let finite = [time, before, time_step, initial].iter().all(|x| x.is_finite());
        let times =
            finite && time >= 0.0 && before >= 0.0 && (time_step > 0.0 || count("started")? != 1);
        let stage = count("stage")? as usize;
        let stages =
            stage < model.n_stages() && array("stage_starts")?.len() == stage.saturating_add(1);
        let known = ["fresh_left", "fresh_first", "relax_left", "relax_driven"];
        let known = known.iter().filter_map(|name| count(name));
        let stages = stages && known.into_iter().all(|known| known <= stage as u64 + 1);
        let steps = count("steps")? <= MOST_STEPS && count("origin_step")? <= count("steps")?;
        let pairs = model.n_pairs() as u64;
        let failed = count("failed_shear")? <= pairs && count("failed_tension")? <= pairs;
        let parts = count("relax_increments").unwrap_or(1);
        let relaxing = (1..=parts).contains(&count("relax_increment").unwrap_or(1))
            && count("relax_since_restart").unwrap_or(0) <= MOST_STEPS;
        Some(fields && factors && times && stages && steps && failed && relaxing)
    }
}

/// Numbers of a pose.
const POSE: usize = 13;

fn numbers(pose: &Pose) -> [f64; POSE] {
    let Pose { shift, turn, velocity, momentum } = pose;
    let turn = turn.coords;
    let all = shift.iter().chain(&turn).chain(velocity).chain(momentum);
    let mut numbers = [0.0; POSE];
    numbers.iter_mut().zip(all).for_each(|(number, x)| *number = *x);
    numbers
}

fn pose(numbers: &[f64; POSE]) -> Pose {
    let [a, b, c, i, j, k, w, u, v, x, l, m, n] = *numbers;
    Pose {
        shift: Vec3::new(a, b, c),
        turn: UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k)),
        velocity: Vec3::new(u, v, x),
        momentum: Vec3::new(l, m, n),
    }
}

/// Whether numbers are those of a pose; nothing is left of it where a run has diverged.
fn is_sound(pose: &Pose) -> bool {
    let turns = (pose.turn.coords.norm_squared() - 1.0).abs() < 1e-9;
    turns && numbers(pose).iter().all(|x| x.is_finite())
}

/// The forces of removed blocks that fade in a load.
fn released(saved: &Saved, load: usize, n_nodes: usize) -> Option<Released> {
    let array = |name: String| saved.arrays.get(&name).map(Vec::as_slice);
    let of = |what: &str| array(format!("released_{load}_{what}"));
    let forces = applied(of("nodes")?, of("forces")?, n_nodes)?;
    let &[began] = array(format!("released_{load}"))? else { return None };
    began.is_finite().then_some(Released { began, forces })
}

/// `None` when a node is not one of `n_nodes`.
fn applied(nodes: &[f64], forces: &[f64], n_nodes: usize) -> Option<Applied> {
    let (forces, rest) = forces.as_chunks::<3>();
    let fits = rest.is_empty() && forces.len() == nodes.len();
    let known =
        nodes.iter().all(|&node| node.fract() == 0.0 && (0.0..n_nodes as f64).contains(&node));
    let entries = nodes.iter().zip(forces).map(|(&node, &force)| (node as u32, force));
    (fits && known).then(|| entries.collect())
}

fn damping_kind(damping: Damping) -> u64 {
    match damping {
        Damping::None => 0,
        Damping::Ratio(_) => 1,
        Damping::Mass(_) => 2,
        Damping::Local(_) => 3,
        Damping::Stiffness(_) => 4,
    }
}

fn damping_number(damping: Damping) -> f64 {
    match damping {
        Damping::None => 0.0,
        Damping::Ratio(number)
        | Damping::Mass(number)
        | Damping::Stiffness(number)
        | Damping::Local(number) => number,
    }
}

fn damping(kind: u64, number: f64) -> Option<Damping> {
    Some(match kind {
        0 => Damping::None,
        1 => Damping::Ratio(number),
        2 => Damping::Mass(number),
        3 => Damping::Local(number),
        4 => Damping::Stiffness(number),
        _ => return None,
    })
}
