//! Checks of stages and probes.

use super::selection::Selected;
use super::{Faults, NameFaults, Rule};
use crate::schema::{
    Body, Deck, Joint, Probe, Quantity, SafetySearch, Stage, StageKind, TimeStep, Where, kinds,
    names, stage_keys,
};
use ddem_core::{ErrorCode, Fault};

pub(super) fn check(deck: &Deck, faults: &mut Faults) {
    let named = deck.stage.iter().enumerate();
    faults.unique("stage", named.map(|(i, s)| (format!("stage[{i}].name"), s.name.as_str())));
    for (i, entry) in deck.stage.iter().enumerate() {
        let at = format!("stage[{i}]");
        stage(&at, entry, faults);
        if entry.kind == StageKind::Safety {
            let wrong = deck.check_search(&entry.search()).into_iter();
            let wrong = wrong.map(|mut fault| {
                fault.place = format!("{at}.{}", fault.place);
                fault
            });
            // Keys that other kinds of stages share have already been checked.
            let new: Vec<Fault> = wrong.filter(|fault| !faults.0.contains(fault)).collect();
            faults.0.extend(new);
        }
    }
    let named = deck.probe.iter().enumerate();
    faults.unique("probe", named.map(|(i, p)| (format!("probe[{i}].name"), p.name.as_str())));
    for (i, entry) in deck.probe.iter().enumerate() {
        probe(deck, &format!("probe[{i}]"), entry, faults);
    }
}

impl Stage {
    /// Faults of the values of a single stage without a deck; locations begin with `stage[0]`.
    #[must_use]
    pub fn check(&self) -> Vec<ddem_core::Fault> {
        let mut faults = Faults::default();
        stage("stage[0]", self, &mut faults);
        faults.0
    }
}

fn stage(at: &str, stage: &Stage, faults: &mut Faults) {
    other_kind(at, stage, faults);
    numbers(at, stage, faults);
    if stage.fields_every.is_some() && stage.frames.is_some() {
        faults.add_help(
            ErrorCode::ConflictingKeys,
            format!("{at}.frames"),
            "`frames` cannot be combined with `fields_every`",
            "give the time between frames or their number",
        );
    }
    if stage.kind == StageKind::Dynamic && stage.duration.is_none() {
        let message = "key `duration` is missing: a dynamic stage needs it";
        faults.add_help(
            ErrorCode::MissingKey,
            format!("{at}.duration"),
            message,
            "the simulated time, in seconds",
        );
    }
}

/// Checks the values of keys, each by itself.
fn numbers(at: &str, stage: &Stage, faults: &mut Faults) {
    faults.optional(format!("{at}.limit"), stage.limit, Rule::AboveZero);
    faults.optional(format!("{at}.tolerance"), stage.tolerance, Rule::Between(0.0, 1.0));
    faults.optional(format!("{at}.duration"), stage.duration, Rule::AboveZero);
    faults.optional(format!("{at}.fields_every"), stage.fields_every, Rule::AboveZero);
    let whole = [
        ("max_steps", stage.max_steps),
        ("increments", stage.increments.map(u64::from)),
        ("frames", stage.frames),
    ];
    for (key, value) in whole {
        if let Some(value) = value {
            faults.not_zero(format!("{at}.{key}"), value);
        }
    }
    if let Some(TimeStep::Seconds(seconds)) = stage.time_step {
        faults.number(format!("{at}.time_step"), seconds, Rule::AboveZero);
    }
    if let Some(damping) = stage.damping {
        damping.check(&format!("{at}.damping"), faults);
    }
}

/// Adds faults of keys that only other kinds of stages have.
fn other_kind(at: &str, stage: &Stage, faults: &mut Faults) {
    // Keys that are not given are not written.
    let written = serde_json::to_value(stage).unwrap_or_default();
    let word = |kind: StageKind| match kind {
        StageKind::Relax => "relax",
        StageKind::Dynamic => "dynamic",
        StageKind::Safety => "safety",
    };
    for key in written.as_object().into_iter().flat_map(|keys| keys.keys()) {
        let Some(kinds) = kinds(key).filter(|kinds| !kinds.contains(&stage.kind)) else { continue };
        let kinds: Vec<&str> = kinds.into_iter().map(word).collect();
        let message = format!("`{key}` is a key of {} stages", kinds.join(" and "));
        let own = names::list(stage_keys(stage.kind));
        let help = format!("a {} stage has {own}", word(stage.kind));
        faults.add_help(ErrorCode::IneffectiveKey, format!("{at}.{key}"), message, help);
    }
}

impl Deck {
    /// Faults of a search for a factor of safety, by key.
    #[must_use]
    pub fn check_search(&self, search: &SafetySearch) -> Vec<Fault> {
        // Unknown names get a fault of their own.
        let known = |name: &str| Some(self.joints.get(name).is_none_or(Joint::can_fail));
        let mut faults = Faults(search.check(&known));
        for name in search.joints.iter().flatten() {
            let known = self.joints.keys().map(String::as_str);
            faults.reference("joints", name, known, ("joint", "`[joints.seam]`"));
        }
        faults.0
    }
}

fn probe(deck: &Deck, at: &str, probe: &Probe, faults: &mut Faults) {
    let help = "a probe has exactly one of `at` (a point) and `where` (a part of the model)";
    match (probe.at, &probe.r#where) {
        (Some(_), Some(_)) => {
            faults.add_help(
                ErrorCode::ConflictingKeys,
                format!("{at}.where"),
                "`where` cannot be combined with `at`",
                help,
            );
        }
        (None, None) => {
            faults.add_help(ErrorCode::MissingKey, at, "the probe has no location", help)
        }
        _ => {}
    }
    if let Some(point) = probe.at {
        faults.finite(format!("{at}.at"), &point);
    }
    if let Some(selector) = &probe.r#where {
        super::selection::selector(
            deck,
            &format!("{at}.where"),
            (selector, Selected::Nodes),
            faults,
        );
    }
    faults.optional(format!("{at}.every"), probe.every, Rule::AboveZero);
    if let Some(steps) = probe.every_steps {
        faults.not_zero(format!("{at}.every_steps"), steps);
    }
    if probe.quantity == Quantity::Reaction && deck.fix.is_empty() {
        faults.add_help(
            ErrorCode::NotSupported,
            format!("{at}.quantity"),
            "there is no reaction to record: the model has no `[[fix]]`",
            "a reaction is the sum of the forces of supports",
        );
    }
    if probe.quantity == Quantity::Stress {
        stress(deck, at, probe.r#where.as_ref(), faults);
    }
}

/// Adds a fault if a stress probe selects rigid blocks, which have no stress. The block at a point
/// is known only with the geometry.
fn stress(deck: &Deck, at: &str, selector: Option<&Where>, faults: &mut Faults) {
    let regions = deck.region.iter().map(|region| (region.name.as_deref(), region.body));
    let sets: Vec<(Option<&str>, Body)> =
        deck.blocks.iter().map(|set| (set.name.as_deref(), set.body)).chain(regions).collect();
    let named = selector.and_then(|selector| selector.set.as_deref());
    let of = |name: &str| sets.iter().find(|(set, _)| *set == Some(name));
    let whose = match named.and_then(of) {
        Some((_, Body::Rigid)) => format!("the blocks of `{}` are rigid", named.unwrap_or("")),
        None if !sets.is_empty() && sets.iter().all(|(_, body)| *body == Body::Rigid) => {
            "all blocks are rigid".to_owned()
        }
        _ => return,
    };
    faults.add_help(
        ErrorCode::NotSupported,
        format!("{at}.quantity"),
        format!("there is no stress to record: {whose}"),
        "only blocks with `body = \"deformable\"` have stresses; the loads of rigid ones are in the \
         tractions of their joints",
    );
}
