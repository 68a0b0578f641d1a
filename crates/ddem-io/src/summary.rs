//! `summary.json`: the model of a run and the outcome of its stages.

mod limit;
mod profile;
mod table;

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use ddem_core::{ChargeSize, MovingBlock, SafetyTrial, Verdict};
pub use ddem_core::{ContactSummary, FragmentSummary, StateSummary};
use ddem_deck::lint::Diagnostic;
use ddem_deck::{Interface, Selection};
use serde::{Deserialize, Deserializer, Serialize};

use crate::output_error::OutputError;
use crate::replace::replace;

pub use limit::{AddedInertia, TimeStepLimit, WorstElement};
pub use profile::StageProfile;
pub use table::quantity;

/// Contents of `summary.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Version of the program.
    pub version: String,
    /// Git commit of the sources of the program, `null` if it is not known.
    #[serde(default)]
    pub revision: Option<String>,
    /// Title of the deck.
    pub title: String,
    /// Blocks of the model.
    pub blocks: u64,
    /// Nodes of all blocks.
    pub nodes: u64,
    /// Elements of all blocks.
    pub elements: u64,
    /// Pairs of points of the joints.
    pub pairs: u64,
    /// Pairs that have failed.
    pub failed_pairs: FailedPairs,
    /// Contacts at the end.
    #[serde(default)]
    pub contacts: ContactSummary,
    /// Fragments at the end.
    #[serde(default)]
    pub fragments: FragmentSummary,
    /// Sets that touch at the start, with the joint between them.
    #[serde(default)]
    pub interfaces: Vec<InterfaceSummary>,
    /// Charges before they detonate, in the order of the deck.
    #[serde(default)]
    pub charges: Vec<ChargeSummary>,
    /// Blocks that curved and slanted shapes have selected.
    #[serde(default)]
    pub selections: Vec<SelectionSummary>,
    /// Inertia that thin cells add to regions.
    #[serde(default)]
    pub added_inertia: Vec<AddedInertia>,
    /// Most distorted element of cells and slanted blocks; `null` without such blocks.
    #[serde(default)]
    pub worst_element: Option<WorstElement>,
    /// Peak memory of the process, `[B]`; 0 if the system does not report it.
    pub peak_memory_bytes: u64,
    /// Completed stages, in order.
    pub stages: Vec<StageSummary>,
    /// Diagnostics of the deck and the run.
    #[serde(default)]
    pub warnings: Vec<Diagnostic>,
    /// Text of the deck.
    pub deck: String,
}

/// Failed pairs, by mode of failure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FailedPairs {
    /// Failed in shear.
    pub shear: u64,
    /// Failed in tension.
    pub tension: u64,
}

/// Two sets that touch.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InterfaceSummary {
    /// Names of the two sets.
    pub sets: [String; 2],
    /// Name of the joint that joins them; `null` if their blocks interact by contact.
    pub joint: Option<String>,
    /// Number of pairs of touching faces.
    pub faces: u64,
}

impl From<Interface> for InterfaceSummary {
    fn from(Interface { sets, joint, faces }: Interface) -> Self {
        Self { sets, joint, faces: faces as u64 }
    }
}

/// One charge before it detonates, with the blocks in their reference positions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ChargeSummary {
    /// Number of walls of cavities that it pushes; 0 if it pushes joints.
    pub walls: u64,
    /// Number of joints that it pushes; 0 if it pushes walls.
    pub joints: u64,
    /// Area of the walls, or of one side of the joints `[m²]`.
    pub area: f64,
    /// Volume of the cavities, or of the gaps of the joints `[m³]`.
    pub volume: f64,
    /// Mass of the explosive `[kg]`.
    pub mass: Option<f64>,
    /// Mass of the explosive per volume of the cavities `[kg/m³]`.
    pub filling: Option<f64>,
    /// Density of the explosive `[kg/m³]`.
    pub density: Option<f64>,
    /// Initial pressure; for a history in time the pressure at factor 1 `[Pa]`.
    pub pressure: f64,
}

impl From<ChargeSize> for ChargeSummary {
    fn from(size: ChargeSize) -> Self {
        Self {
            walls: size.walls as u64,
            joints: size.joints as u64,
            area: size.area,
            volume: size.volume,
            mass: size.mass,
            filling: size.filling(),
            density: size.density,
            pressure: size.pressure,
        }
    }
}

/// Blocks that a curved or slanted shape has selected.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SelectionSummary {
    /// Place in the deck.
    pub entry: String,
    /// Action on the blocks.
    pub what: String,
    /// Number of blocks.
    pub blocks: u64,
    /// Volume of the blocks, including half of the surrounding joints `[m³]`.
    pub volume: f64,
    /// Name of the shape.
    pub shape: String,
    /// Volume of the shape, if it is known `[m³]`.
    pub holds: Option<f64>,
    /// True if parts of the shape lie outside of the sets of blocks.
    #[serde(default)]
    pub sticks_out: bool,
}

impl From<Selection> for SelectionSummary {
    fn from(selection: Selection) -> Self {
        let Selection { entry, what, blocks, volume, shape, holds, sticks_out } = selection;
        let (blocks, shape) = (blocks as u64, shape.to_owned());
        Self { entry, what, blocks, volume, shape, holds, sticks_out }
    }
}

/// Summary of one stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageSummary {
    /// Name in the deck.
    pub name: String,
    /// Kind in the deck.
    pub kind: String,
    /// Verdict on the stage.
    #[serde(default)]
    pub verdict: Verdict,
    /// Moving blocks if the stage fails, those with the largest distance in the stage first.
    #[serde(default)]
    pub moving: Vec<MovingBlock>,
    /// Factor of safety, if it was searched for and lies within the bracket.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// Largest stable and smallest unstable factor, if the factor of safety was searched for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bracket: Option<[Option<f64>; 2]>,
    /// Factors that were tried, in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub trials: Vec<SafetyTrial>,
    /// Steps taken.
    pub steps: u64,
    /// Time step `[s]`.
    #[serde(deserialize_with = "number_or_null")]
    pub time_step: f64,
    /// Part of the model that limits the time step at the start of a dynamic stage.
    #[serde(default)]
    pub limit: Option<TimeStepLimit>,
    /// Wall time `[s]`.
    #[serde(deserialize_with = "number_or_null")]
    pub wall_seconds: f64,
    /// Node updates per second `[1/s]`.
    #[serde(deserialize_with = "number_or_null")]
    pub node_updates_per_second: f64,
    /// Ratio of unbalanced forces at the end.
    #[serde(deserialize_with = "number_or_null")]
    pub unbalanced: f64,
    /// Energy imbalance at the end, relative to the largest energy.
    #[serde(deserialize_with = "number_or_null", default)]
    pub imbalance: f64,
    /// State at the end; for a stage that searches for a factor of safety, the state from which it
    /// started.
    #[serde(default)]
    pub state: StateSummary,
    /// Wall times by phase, if the run is profiled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<StageProfile>,
}

impl Summary {
    /// Writes the file; if that fails, the old file is unchanged.
    ///
    /// # Errors
    ///
    /// The file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        replace(path.as_ref(), |part| {
            let writing = |e| OutputError::io(part, "writing", e);
            let mut file = BufWriter::new(File::create(part).map_err(writing)?);
            serde_json::to_writer_pretty(&mut file, self).map_err(|e| writing(e.into()))?;
            file.write_all(b"\n").and_then(|()| file.flush()).map_err(writing)
        })
    }

    /// Reads the file.
    ///
    /// # Errors
    ///
    /// [`OutputError::Unusable`] if it is not a summary.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, OutputError> {
        let path = path.as_ref();
        let text = fs::read(path).map_err(|e| OutputError::io(path, "reading", e))?;
        serde_json::from_slice(&text).map_err(|e| {
            let message = format!("not a summary of a run ({e}): run the deck again");
            OutputError::unusable(path, message)
        })
    }
}

/// Number, or NaN for `null`: JSON has no NaN and writes it as `null`.
fn number_or_null<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Option::deserialize(deserializer).map(|number| number.unwrap_or(f64::NAN))
}

/// Peak memory of this process, `[B]`; 0 if the system does not report it.
pub fn peak_memory_bytes() -> u64 {
    peak().unwrap_or(0)
}

/// Peak memory `[B]` from the "high water mark" in `/proc/self/status`: `VmHWM:   12345 kB`.
#[cfg(target_os = "linux")]
fn peak() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}

#[cfg(target_os = "macos")]
fn peak() -> Option<u64> {
    use nix::sys::resource::{UsageWho, getrusage};
    // Bytes here, unlike on other systems.
    let usage = getrusage(UsageWho::RUSAGE_SELF).ok()?;
    u64::try_from(usage.max_rss()).ok()
}

#[cfg(not(any(target_os = "linux", target_os = "macos")))]
fn peak() -> Option<u64> {
    None
}
