//! Blocks that block theory finds able to move, and their factors by limit equilibrium.

use std::collections::HashSet;

use ddem_core::problem::{FRICTION, Vec3};
use ddem_cut::{CommonFace, Compass, FirstMotion, JointFace, PlaneSource, merged_faces};

use super::CutRock;
use crate::build::geometry::Selector;
use crate::schema::{Joint, Where};

/// Vertical part of the normal of an outer face above which the face is free.
const UPWARD: f64 = 1e-6;

/// Part of a unit vector that is only rounding.
const ROUNDED: f64 = 1e-12;

/// Names of the axes along which supports hold.
const AXES: &str = "xyz";

/// Gravity of a deck without one `[m/s²]`.
const GRAVITY: f64 = 9.81;

/// Verdict of block theory on a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockMode {
    /// Block without a free face.
    Buried,
    /// Block that a support, a bridge of rock, or the rock around the regions holds.
    Held,
    /// Block that the joints keep in place, whatever their strength.
    Keyed,
    /// Fall away from all joints.
    Falls,
    /// Sliding on one joint.
    SlidesOnOne,
    /// Sliding on two joints, along their line.
    SlidesOnTwo,
    /// Excavated block.
    Removed,
}

impl BlockMode {
    /// Word in `blocks.csv`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Buried => "buried",
            Self::Held => "held",
            Self::Keyed => "keyed",
            Self::Falls => "falls",
            Self::SlidesOnOne => "slides",
            Self::SlidesOnTwo => "slides on two",
            Self::Removed => "removed",
        }
    }
}

/// First motion of a block out of a free face.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockVerdict {
    /// Kind of the motion.
    pub mode: BlockMode,
    /// Factor of safety by limit equilibrium; `None` without motion, or if a joint on which the
    /// block slides never fails or has Barton's criterion.
    pub factor: Option<f64>,
    /// Plunge and trend of the motion `[degrees]`.
    pub plunge_trend: Option<[f64; 2]>,
    /// Cuts with the joints on which the block slides.
    pub on: Vec<u32>,
    /// Area of the free faces of the cell `[m²]`.
    pub free_area: f64,
}

/// Face of a block on a joint, with the number of the cut if a cut made it, or on a smooth wall; the
/// strength is `None` if there is no linear one.
#[derive(Clone, Copy)]
struct ExposedJoint {
    normal: Vec3,
    area: f64,
    cut: Option<u32>,
    is_wall: bool,
    strength: Option<[f64; 2]>,
}

/// Surroundings of a block.
#[derive(Clone, Default)]
struct Surroundings {
    free: bool,
    held: bool,
    joints: Vec<ExposedJoint>,
    weight: Vec3,
}

/// Deck's selectors that matter to blocks at the first excavation.
struct FirstStage<'a> {
    rock: &'a CutRock,
    removed: Vec<bool>,
    /// Supports from the start.
    fixed: Vec<(Selector, &'a str)>,
    /// Joints from the start: their selectors, cuts and names.
    assigned: Vec<(Selector, Option<&'a String>, &'a String)>,
}

impl CutRock {
    /// Verdict of block theory on the block of each cell, once the first excavation is done.
    #[must_use]
    pub fn verdicts(&self) -> Vec<BlockVerdict> {
        let stage = FirstStage::new(self);
        let is_whole = |face: &CommonFace| {
            self.is_joined(face) && face.cells.iter().all(|&cell| !stage.removed[cell as usize])
        };
        let blocks = self.complex.blocks_where(&self.common, is_whole);
        let mut free_areas = vec![0.0; blocks.len()];
        let around = stage.surroundings(&blocks, &mut free_areas);
        let of = |(cell, &block): (usize, &u32)| {
            if stage.removed[cell] {
                return BlockVerdict::still(BlockMode::Removed);
            }
            let north = Compass::new(self.region(cell).north.into()).unwrap_or_default();
            let verdict = around[block as usize].verdict(&north);
            BlockVerdict { free_area: free_areas[cell], ..verdict }
        };
        blocks.iter().enumerate().map(of).collect()
    }

    /// True if a selector has a cell: its centroid lies in the ranges, and each plane holds one of
    /// its faces.
    pub(super) fn selects(&self, selector: &Selector, cell: usize) -> bool {
        let points = self.complex.points();
        let own = &self.complex.cells()[cell];
        let mut faces = own.faces.iter();
        let on = |face: &ddem_cut::CellFace| {
            face.corners.iter().all(|&corner| selector.on_planes(&points[corner as usize]))
        };
        selector.has_set(own.region as usize)
            && selector.in_ranges(&self.properties[cell].centroid)
            && (selector.planes() == 0 || faces.any(on))
    }
}

impl<'a> FirstStage<'a> {
    fn new(rock: &'a CutRock) -> Self {
        let deck = &rock.deck;
        let sets = rock.selectable();
        let number = |name: &String| deck.stage_number(name);
        let first = deck.remove.iter().filter_map(|entry| number(entry.from.as_ref()?)).min();
        let now = |from: Option<&String>| from.is_none_or(|name| number(name) == first);
        let select = |of: &Where| Selector::new(of, &sets);
        let mut removed = vec![false; rock.properties.len()];
        for entry in deck.remove.iter().filter(|entry| now(entry.from.as_ref())) {
            let selector = select(&entry.r#where);
            for (cell, removed) in removed.iter_mut().enumerate() {
                *removed |= rock.selects(&selector, cell);
            }
        }
        let fixed = deck.fix.iter().filter(|entry| entry.from.is_none());
        let fixed = fixed.map(|entry| (select(&entry.r#where), entry.axes.as_str())).collect();
        let assigned = deck.assign.iter().filter(|entry| entry.from.is_none());
        let assigned = assigned
            .filter_map(|entry| {
                let of = &entry.r#where;
                Some((select(of), of.cut.as_ref(), entry.joint.as_ref()?))
            })
            .collect();
        Self { rock, removed, fixed, assigned }
    }

    /// Surroundings of each block. Adds the areas of free faces to those of their cells.
    fn surroundings(&self, blocks: &[u32], free_areas: &mut [f64]) -> Vec<Surroundings> {
        let rock = self.rock;
        let n = blocks.iter().max().map_or(0, |last| *last as usize + 1);
        let mut around = vec![Surroundings::default(); n];
        let mut shared = HashSet::new();
        for common in &rock.common {
            let [a, b] = common.cells.map(|cell| cell as usize);
            shared.extend([(a, common.faces[0]), (b, common.faces[1])]);
            let [own, other] = [blocks[a] as usize, blocks[b] as usize];
            match [self.removed[a], self.removed[b]] {
                [true, true] => {}
                [true, false] => {
                    around[other].free = true;
                    free_areas[b] += rock.complex.common_area(common);
                }
                [false, true] => {
                    around[own].free = true;
                    free_areas[a] += rock.complex.common_area(common);
                }
                [false, false] if own == other => {}
                [false, false] => match self.joint(common) {
                    Some(joint) => {
                        around[own].joints.push(joint);
                        let turned = ExposedJoint { normal: -joint.normal, ..joint };
                        around[other].joints.push(turned);
                    }
                    None => [own, other].into_iter().for_each(|block| around[block].held = true),
                },
            }
        }
        let gravity = Vec3::from(rock.deck.model.gravity);
        let gravity = if gravity == Vec3::zeros() { -Vec3::z() * GRAVITY } else { gravity };
        for (cell, &block) in blocks.iter().enumerate().filter(|(cell, _)| !self.removed[*cell]) {
            let block = &mut around[block as usize];
            let material = rock.deck.materials.get(&rock.region(cell).material);
            let density = material.map_or(1.0, |material| material.density);
            block.weight += gravity * (density * rock.properties[cell].volume);
            for face in 0..rock.complex.cells()[cell].faces.len() {
                if !shared.contains(&(cell, face as u32)) {
                    free_areas[cell] += self.outer(cell, face, block);
                }
            }
        }
        around
    }

    /// Adds an outer face of a cell to the surroundings of its block. Returns its area if it is free.
    fn outer(&self, cell: usize, face: usize, block: &mut Surroundings) -> f64 {
        let complex = &self.rock.complex;
        let face = &complex.cells()[cell].faces[face];
        if complex.plane(face).source != PlaneSource::Region {
            return 0.0;
        }
        let corners = || face.corners.iter().map(|&corner| complex.points()[corner as usize]);
        let holds = |(selector, _): &&(Selector, &str)| match selector.planes() {
            0 => self.rock.selects(selector, cell),
            _ => {
                selector.has_set(complex.cells()[cell].region as usize)
                    && corners().all(|x| selector.contains(&x))
            }
        };
        let normal = complex.outward(face);
        let names: String = self.fixed.iter().filter(holds).map(|(_, axes)| *axes).collect();
        let fixed: Vec<usize> = (0..3).filter(|&axis| names.contains(&AXES[axis..=axis])).collect();
        let area = face.area(complex.points()).norm();
        let wall = |normal: Vec3| ExposedJoint {
            normal,
            area,
            cut: None,
            is_wall: true,
            strength: Some([0.0; 2]),
        };
        let crosses = fixed.iter().any(|&axis| normal[axis].abs() > ROUNDED);
        let is_smooth = fixed.len() == 1 && normal[fixed[0]].abs() >= 1.0 - ROUNDED;
        block.held |= crosses && !is_smooth;
        // The block can move neither way along a supported axis.
        for along in fixed.into_iter().map(|axis| Vec3::ith(axis, 1.0)) {
            block.joints.extend([wall(along), wall(-along)]);
        }
        if crosses {
            return 0.0;
        }
        let free = normal.z > UPWARD;
        block.free |= free;
        block.held |= !free;
        if free { area } else { 0.0 }
    }

    /// Joint of a common face with the normal out of its first cell; `None` if rock holds it.
    fn joint(&self, common: &CommonFace) -> Option<ExposedJoint> {
        let (rock, complex) = (self.rock, &self.rock.complex);
        let face = &complex.cells()[common.cells[0] as usize].faces[common.faces[0] as usize];
        let (centre, normal) = (complex.common_middle(common), complex.outward(face));
        let (cut, bridge) = match complex.plane(face).source {
            PlaneSource::Region => (None, false),
            PlaneSource::Cut(cut) => (Some(cut), !complex.covers(common.plane, &centre)),
            PlaneSource::Bridge(cut) => (Some(cut), true),
        };
        let entry = cut.and_then(|cut| rock.deck.cut.get(cut as usize));
        if complex.fracture(common.plane).is_some() && entry?.bridge_joint().is_none() {
            // Rock beside the fracture holds the face unless the fracture covers all of it.
            let corners = face.corners.iter().map(|&corner| complex.points()[corner as usize]);
            if !corners.into_iter().all(|x| complex.covers(common.plane, &x)) {
                return None;
            }
        }
        let mut name = match entry {
            Some(entry) if bridge => Some(entry.bridge_joint()?),
            Some(entry) => Some(entry.joint.as_ref()?),
            None => rock.region_joint(common),
        };
        let regions = common.cells.map(|cell| complex.cells()[cell as usize].region as usize);
        for (selector, of_cut, joint) in self.assigned.iter().filter(|_| !bridge) {
            let same =
                of_cut.is_none_or(|name| entry.and_then(|of| of.name.as_ref()) == Some(name));
            let in_set = regions.iter().any(|&region| selector.has_set(region));
            if same && in_set && selector.contains_face(&centre, &normal) {
                name = Some(joint);
            }
        }
        let strength = match name {
            Some(name) => rock.deck.joints.get(name).and_then(strength),
            // Regions without a joint between them meet in contact.
            None => {
                Some([0.0, libm::tan(rock.deck.contact.friction.unwrap_or(FRICTION).to_radians())])
            }
        };
        Some(ExposedJoint {
            normal,
            area: complex.common_area(common),
            cut,
            is_wall: false,
            strength,
        })
    }
}

/// Cohesion `[Pa]` and tangent of the friction angle of a joint that fails by Mohr and Coulomb.
fn strength(joint: &Joint) -> Option<[f64; 2]> {
    let friction = joint.friction.unwrap_or_default().to_radians();
    let linear = joint.can_fail() && joint.jrc.is_none();
    linear.then(|| [joint.cohesion.unwrap_or_default(), libm::tan(friction)])
}

impl Surroundings {
    fn verdict(&self, compass: &Compass) -> BlockVerdict {
        if !self.free {
            return BlockVerdict::still(BlockMode::Buried);
        }
        if self.held {
            return BlockVerdict::still(BlockMode::Held);
        }
        let face = |joint: &ExposedJoint| {
            let [cohesion, tan_friction] = joint.strength.unwrap_or_default();
            JointFace { normal: joint.normal, area: joint.area, cohesion, tan_friction }
        };
        let faces = merged_faces(&self.joints.iter().map(face).collect::<Vec<_>>());
        let Some(motion) = FirstMotion::new(&self.weight, &faces) else {
            return BlockVerdict::still(BlockMode::Keyed);
        };
        let normals = || motion.on.iter().flatten().map(|(number, _)| faces[*number].normal);
        let below = || {
            self.joints.iter().filter(|joint| {
                joint.area > 0.0 && normals().any(|normal| (normal - joint.normal).norm() < 1e-9)
            })
        };
        let mut on: Vec<u32> = below().filter_map(|joint| joint.cut).collect();
        on.sort_unstable();
        on.dedup();
        let is_joint = |normal: &Vec3| {
            let of = |joint: &ExposedJoint| (normal - joint.normal).norm() < 1e-9;
            self.joints.iter().any(|joint| !joint.is_wall && of(joint))
        };
        let mode = match normals().filter(is_joint).count() {
            0 => BlockMode::Falls,
            1 => BlockMode::SlidesOnOne,
            _ => BlockMode::SlidesOnTwo,
        };
        let linear = below().all(|joint| joint.strength.is_some());
        let factor = linear.then(|| motion.factor(&faces));
        let plunge_trend = Some(compass.plunge_trend(&motion.direction));
        BlockVerdict { mode, factor, plunge_trend, on, free_area: 0.0 }
    }
}

impl BlockVerdict {
    fn still(mode: BlockMode) -> Self {
        Self { mode, factor: None, plunge_trend: None, on: Vec::new(), free_area: 0.0 }
    }
}
