//! Cut of some regions: its shape, and how it divides their cells.

use std::sync::Arc;

use ddem_core::problem::Vec3;
use ddem_cut::{CellComplex, Compass, CutCount, CutPlane, Fracture, Ground, RandomStream, Tunnel};

use crate::schema::RockCut;

/// Number of the stream of random numbers that decide which cells the first cut leaves whole.
const PERSISTENCE_STREAM: u64 = 3 << 40;

/// Planes of a cut, and the regions that they cut.
pub(super) struct RegionCut {
    pub(super) shape: CutShape,
    pub(super) compass: Compass,
    pub(super) seed: u64,
    pub(super) regions: Vec<u32>,
}

/// Shape of a cut.
#[derive(PartialEq)]
pub(super) enum CutShape {
    Planes(Vec<CutPlane>),
    Fractures(Vec<Fracture>),
    Tunnel(Tunnel),
    Ground(Arc<Ground>),
    /// Seeds of Voronoi cells `[m]`.
    Seeds(Vec<Vec3>),
}

impl RegionCut {
    /// Cuts the cells with these flags.
    pub(super) fn apply(
        &self,
        rock: &mut CellComplex,
        entry: &RockCut,
        number: u32,
        allowed: Vec<bool>,
    ) -> CutCount {
        match &self.shape {
            CutShape::Planes(planes) => match persistence(entry) {
                None => rock.cut(planes, allowed),
                Some(share) => {
                    let stream = PERSISTENCE_STREAM + u64::from(number);
                    let numbers = RandomStream::new(self.seed, stream);
                    let bridges = entry.bridge_joint().is_some();
                    rock.cut_persistent(planes, allowed, share, bridges, numbers)
                }
            },
            CutShape::Fractures(triangles) if entry.surface.is_some() => {
                rock.cut_surface(triangles, allowed)
            }
            CutShape::Fractures(fractures) => rock.cut_fractures(fractures, allowed),
            CutShape::Tunnel(tunnel) => rock.cut_tunnel(tunnel, allowed),
            CutShape::Ground(ground) => rock.cut_ground(ground, &allowed),
            CutShape::Seeds(seeds) => rock.cut_voronoi(seeds, number, entry.join, &allowed),
        }
    }
}

/// Share of the cells that the planes of a set cut; `None` for all.
fn persistence(entry: &RockCut) -> Option<f64> {
    entry.set.as_ref()?.persistence.filter(|share| *share < 1.0)
}
