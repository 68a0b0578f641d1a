//! Diagnostics: warnings about settings and results that are allowed but may be unintended.
//!
//! Each rule has a stable code. `[lint] allow = ["code"]` in a deck silences a rule.
//! `docs/diagnostics.md` lists all rules.

use std::fmt;

use ddem_core::SafetySearch;
use ddem_core::problem::shown;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Severity of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The run continues; the result may not be the intended one.
    Warning,
}

ddem_core::codes! {
    /// Code of a warning.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    Code:
    AddedInertia "added-inertia" "Thin cells and sharp corners of a region have more inertia than 1 % of its mass."
    BlastAtRest "blast-at-rest" "A charge without `from` detonates in a relax stage before the first dynamic stage."
    BlocksInCavity "blocks-in-cavity" "Blocks of another set stand inside the cavity of a charge."
    CavityChanged "cavity-changed" "The volume of a cavity changed by more than 10 % before its charge detonated."
    ContactWithoutEffect "contact-without-effect" "`[contact]` has keys, but no contacts are searched for."
    DefaultFriction "default-friction" "Two sets touch without a joint and have the default friction, although one names a joint."
    DividedCavity "divided-cavity" "A cavity borders on, or continues among, blocks that `[[refine]]` splits in another way."
    EmptySet "empty-set" "`[[remove]]` removes all blocks of a set."
    EnergyImbalance "energy-imbalance" "The energy balance of a stage is off by more than 1 % of the largest energy."
    FactorAboveBracket "factor-above-bracket" "The blocks hold with the largest factor of `bracket`."
    FactorBelowBracket "factor-below-bracket" "The blocks fail with the smallest factor of `bracket`."
    FailedStage "failed-stage" "A stage failed, and `on_failure` or a search for the factor of safety lets the run continue."
    FarProbe "far-probe" "The point `at` of a probe lies outside of all blocks."
    FullCavity "full-cavity" "The explosive has more volume than its cavity."
    GapBetweenSets "gap-between-sets" "Two sets do not touch: there is a narrow gap between them."
    HeldBoundary "held-boundary" "Nodes of a boundary are fixed in all directions."
    HeldJoint "held-joint" "A `[[fix]]` holds both sides of joints that can fail."
    InfeasibleRestitution "infeasible-restitution" "`restitution` is below that of critical damping."
    JointDoesNotFill "joint-does-not-fill" "Two sets are not joined: their gap is not as wide as the joint is thick."
    LoadAtRest "load-at-rest" "A load in a relax stage has a history that begins at 0."
    LooseTolerance "loose-tolerance" "`tolerance` of a safety stage is too large for its `resolution`."
    ManyTriangles "many-triangles" "A `surface` that is no ground cuts regions by more than 500 triangles."
    MissingRemove "missing-remove" "A charge in a hole finds no cavity there."
    NoSupport "no-support" "The model has gravity, but neither `[[fix]]` nor `[[boundary]]`."
    NonconformingJoints "nonconforming-joints" "A charge selects joints between faces that do not match."
    NonmonotonicSafety "nonmonotonic-safety" "Blocks held with a larger factor than one with which they failed."
    NotInEquilibrium "not-in-equilibrium" "In Python, the first relaxation of a search for the factor of safety is undecided."
    OpenCavity "open-cavity" "The cavity of a charge is open to the outside."
    Overdamped "overdamped" "The damping `ratio` of a stage is above 1, critical damping."
    PartlyCoveredFaces "partly-covered-faces" "A load or boundary leaves out faces that other blocks cover in part."
    ProbeOfRemovedBlocks "probe-of-removed-blocks" "All blocks that a probe records are removed by some stage."
    ReflectingBoundary "reflecting-boundary" "A `[[fix]]` holds the nodes of a boundary along its normal in a dynamic stage."
    ReleaseWithoutEffect "release-without-effect" "`release` of a `[[remove]]` in a relax stage with one increment."
    SetsInCavity "sets-in-cavity" "The cavity of a charge borders on blocks of another set."
    SetsNotInContact "sets-not-in-contact" "Two sets touch, but they are neither joined nor searched for contacts."
    SharedCavity "shared-cavity" "Two charges push walls of one cavity."
    SoftContact "soft-contact" "Contacts are so soft that blocks sink into each other."
    SteepDilation "steep-dilation" "The dilation of a joint exceeds its residual friction."
    StiffContact "stiff-contact" "A given contact stiffness shortens the time step much."
    SuspiciousUnit "suspicious-unit" "A number looks as if it were given in another unit."
    UnbalancedStress "unbalanced-stress" "Supports and loads of the first stage do not carry the in-situ stress."
    UnbalancedWeight "unbalanced-weight" "The gradient of the in-situ stress does not balance the weight."
    UndampedSliding "undamped-sliding" "Deformable blocks slid without any damping."
    UndecidedTrial "undecided-trial" "A trial of a search for the factor of safety reached `max_steps`."
    UnfinishedRelease "unfinished-release" "The dynamic stages are shorter than `release` of a `[[remove]]`."
    UnknownStage "unknown-stage" "A stage of a program has nearly the name of a stage of its deck."
    UnreachableTension "unreachable-tension" "The tensile strength of a joint exceeds cohesion/tan(friction)."
    UnsafeTimeStep "unsafe-time-step" "A given `time_step` is stable only until joints fail."
    UnselectedWalls "unselected-walls" "`where` of a charge selects only some walls of its cavity."
    UpwardGravity "upward-gravity" "`gravity` points along +z."
    VentedCharge "vented-charge" "The gas of a charge vented at its detonation."
    WaitingStages "waiting-stages" "In Python, parts of the model wait for stages that have not begun."
    WallsInBoundary "walls-in-boundary" "A boundary selects walls of a cavity."
    WeakCharge "weak-charge" "The initial pressure of an explosive is below that of the air."
}

/// A diagnostic: rule, location, message and advice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnostic {
    /// Rule.
    pub code: Code,
    /// Severity.
    pub severity: Severity,
    /// Path of the key in the deck, as in `load[0].history`.
    pub place: String,
    /// Finding, with numbers.
    pub message: String,
    /// Advice.
    pub help: String,
}

impl Diagnostic {
    /// A warning at a location of the deck, with advice.
    #[must_use]
    pub fn warning(
        code: Code,
        place: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        let (place, message, help) = (place.into(), message.into(), help.into());
        Self { code, severity: Severity::Warning, place, message, help }
    }

    /// The same diagnostic with a location below `place`.
    #[must_use]
    pub fn below(mut self, place: &str) -> Self {
        self.place = format!("{place}.{}", self.place);
        self
    }
}

/// Location, message, advice and code on one line.
impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { code, place, message, help, .. } = self;
        let code = code.name();
        if help.contains('\n') {
            // Lines to paste come at the end.
            write!(f, "{place}: {message} [{code}]; {help}")
        } else {
            write!(f, "{place}: {message}; {help} [{code}]")
        }
    }
}

/// Largest ratio of the tolerance to the resolution of a factor of safety.
const FINER: f64 = 0.02;

/// Warning about a search with a tolerance that is too large for its resolution; the place is the
/// key.
#[must_use]
pub fn loose_tolerance(search: &SafetySearch) -> Option<Diagnostic> {
    let SafetySearch { tolerance, resolution, .. } = *search;
    let most = FINER * resolution;
    (tolerance > most * (1.0 + 1e-9)).then(|| {
        let message =
            format!("with a `tolerance` of {tolerance:e} trials that do not hold count as at rest");
        let help = format!("at most {most:e} for a `resolution` of {}", shown(resolution));
        Diagnostic::warning(Code::LooseTolerance, "tolerance", message, help)
    })
}

/// Warning about a load, given by its number, whose history is 0 in a relax stage.
#[must_use]
pub fn load_at_rest(load: usize, stage: &str) -> Diagnostic {
    let stage = if stage.is_empty() {
        "this relaxation".to_owned()
    } else {
        format!("relax stage `{stage}`")
    };
    let message = format!("load {load} does not act in {stage}: its history is 0 there");
    let help = "time stands still in a relax stage: let it act in a dynamic stage, or leave out its history";
    Diagnostic::warning(Code::LoadAtRest, format!("load[{load}].history"), message, help)
}
