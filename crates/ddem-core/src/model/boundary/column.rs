//! Free-field columns: motion of the ground beside the model as if the model were not there.
//!
//! A column of unit area stands behind each upright line of nodes of a side. It has the levels,
//! rock and joints of that line. It deforms in shear and compression only, like level ground under
//! a plane wave that travels straight up. It has no weight, and its joints do not fail.

use std::collections::BTreeMap;

use super::active::ActiveColumn;
use super::{BoundaryForce, Resistance, resistance};
use ddem_mechanics::collide::FaceId;
use ddem_mechanics::element::Elastic;
use ddem_mechanics::law::SpringStiffness;
use ddem_mechanics::math::leapfrog::{coefficients, local_damping};
use ddem_mesh::properties::Properties;
use ddem_mesh::slot::NodeSlot;
use ddem_mesh::{BlockFace, Geometry, TributaryLengths, Vec3, moved_to};

/// Segment between two levels: traction per difference of displacements `[Pa/m]`.
#[derive(Clone, Copy, Debug)]
struct ColumnSegment {
    normal: f64,
    shear: f64,
    /// Normal and shear traction on upright planes; 0 for springs.
    across: [f64; 2],
    /// Mass per area `[kg/m²]`.
    mass: f64,
    /// True for a segment of a block, false for a joint.
    block: bool,
}

/// One column, with its levels from the foot up.
#[derive(Clone, Debug)]
pub struct Column {
    /// Nodes of the model in front of it.
    pub nodes: Vec<u32>,
    /// Storage of each node.
    pub(crate) slots: Vec<NodeSlot>,
    segments: Vec<ColumnSegment>,
    /// Mass of each level `[kg/m²]`.
    mass: Vec<f64>,
    /// `ρ c` of the rock at its foot, x, y and z `[Pa s/m]`.
    pub(super) impedance: Vec3,
    /// Index of its lowest level among the levels of all columns.
    pub(crate) first: usize,
    /// Stiffness over mass of each node at the start of the run, by axis `[1/s²]`.
    pub(crate) squares: Vec<[f64; 3]>,
}

/// A node of a side, and the level of the column to which it is connected.
#[derive(Clone, Debug)]
pub struct SideNode {
    /// Number of the node.
    pub node: u32,
    /// Index of the level among the levels of all columns.
    level: usize,
    /// Dashpots between node and level `[N s/m]`.
    pub resistance: Resistance,
    outward: Vec3,
    /// Area below and above the level `[m²]`.
    areas: [f64; 2],
}

/// Motion of the columns.
#[derive(Clone, Debug, Default)]
pub(crate) struct ColumnMotion {
    /// Velocity at the end of the step `[m/s]`.
    pub(crate) ahead: Vec<Vec3>,
    /// Velocity at the present time `[m/s]`.
    pub(crate) mean: Vec<Vec3>,
    /// Tractions on upright planes in the segment above each level `[Pa]`: shear along x and y, and
    /// normal.
    above: Vec<Vec3>,
    /// Forces of the segments on each level, per area `[Pa]`.
    forces: Vec<Vec3>,
}

/// Coefficients of a step of the columns.
pub(crate) struct ColumnStep<'a> {
    /// h, the time between the half steps before and after `[s]`.
    pub(crate) interval: f64,
    /// Part θ of the velocity change that leads to the present time.
    pub(crate) fraction: f64,
    /// α of local damping.
    pub(crate) local: f64,
    /// β of damping by the stiffness of the blocks `[s]`.
    pub(crate) stiffness: f64,
    /// Factor of each boundary's wave.
    pub(crate) factors: &'a [f64],
    /// Velocity of each fix.
    pub(crate) velocities: &'a [[f64; 3]],
    /// Damping `c/m` at a level of a column, excavated or not, by axis `[1/s]`.
    pub(crate) rates: &'a dyn Fn(&Column, usize, bool) -> [f64; 3],
}

impl ColumnMotion {
    /// Sets the motion of this number of levels to zero.
    pub(crate) fn clear(&mut self, levels: usize) {
        for field in [&mut self.ahead, &mut self.mean, &mut self.above, &mut self.forces] {
            field.clear();
            field.resize(levels, Vec3::zeros());
        }
    }

    /// Force of a column on a side node, without the dashpot force on the node's own velocity.
    pub(super) fn force_on(&self, side: &SideNode) -> BoundaryForce {
        let n = side.outward;
        let traction = |s: Vec3| Vec3::new(s.z * n.x, s.z * n.y, s.x * n.x + s.y * n.y);
        let [below, above] = side.areas;
        let mut force = traction(self.above[side.level]) * above;
        if below > 0.0 {
            force += traction(self.above[side.level - 1]) * below;
        }
        BoundaryForce { force, wave: side.resistance * self.mean[side.level] }
    }
}

impl Column {
    /// Computes one step, (M2), from the displacements and velocities of all levels.
    pub(crate) fn step(
        &self,
        active: &ActiveColumn,
        step: &ColumnStep<'_>,
        levels: &[[Vec3; 2]],
        motion: &mut ColumnMotion,
    ) {
        for (i, segment) in self.segments.iter().enumerate() {
            let at = self.first + i;
            let ([u, v], [next_u, next_v]) = (levels[at], levels[at + 1]);
            let mut stretch = next_u - u;
            if segment.block {
                stretch += (next_v - v) * step.stiffness;
            }
            let [across, along] = segment.across;
            motion.above[at] = stretch.component_mul(&Vec3::new(along, along, across));
            let ColumnSegment { normal, shear, .. } = *segment;
            let traction = stretch.component_mul(&Vec3::new(shear, shear, normal));
            motion.forces[at] += traction;
            motion.forces[at + 1] -= traction;
        }
        let waves = active.base.waves.iter();
        let wave: Vec3 = waves.map(|(boundary, wave)| wave * step.factors[*boundary]).sum();
        for i in 0..self.nodes.len() {
            let at = self.first + i;
            let force = motion.forces[at];
            let rates = (step.rates)(self, i, active.excavated[i]);
            let zero = (Vec3::zeros(), Vec3::zeros());
            let (dashpot, wave) = if i == 0 { (active.base.impedance, wave) } else { zero };
            for k in 0..3 {
                let now = levels[at][1][k];
                let force = force[k] - local_damping(step.local, force[k], now) + wave[k];
                let (m, c) = (self.mass[i], rates[k] * self.mass[i] + dashpot[k]);
                let [a, b] = coefficients(m / step.interval, c);
                let free = a * now + b * force;
                let ahead = active.held[i][k].map_or(free, |fix| step.velocities[fix][k]);
                motion.ahead[at][k] = ahead;
                motion.mean[at][k] = now * (1.0 - step.fraction) + ahead * step.fraction;
            }
        }
    }
}

/// Reason why no column can stand behind a face.
#[derive(Clone, Copy, Debug)]
pub enum NoColumn {
    /// The face is level: its normal points up or down.
    Level,
    /// The blocks have no upright edge, or their other edges are not level.
    Aslant,
    /// The side continues in blocks that do not match.
    Unmatched,
}

/// Builder of columns and side nodes, face by face.
pub struct ColumnBuilder<'a> {
    geometry: &'a Geometry,
    /// Geometry at the start: beside excavations the ground continues as it was.
    start: &'a Geometry,
    properties: &'a Properties,
    /// First free index among the levels of all columns.
    first: &'a mut usize,
    columns: Vec<Column>,
    sides: Vec<SideNode>,
    /// Column by its lowest node.
    by_base: BTreeMap<u32, usize>,
}

impl<'a> ColumnBuilder<'a> {
    /// Builder without columns; `first` is the first free index among the levels of all columns.
    pub fn new(
        geometry: &'a Geometry,
        start: &'a Geometry,
        properties: &'a Properties,
        first: &'a mut usize,
    ) -> Self {
        let by_base = BTreeMap::new();
        Self { geometry, start, properties, first, columns: Vec::new(), sides: Vec::new(), by_base }
    }

    /// Columns, and the side nodes that are connected to them.
    pub fn done(self) -> (Vec<Column>, Vec<SideNode>) {
        (self.columns, self.sides)
    }

    /// Adds the columns behind the nodes of a face, given with their tributary lengths.
    pub fn add_columns(
        &mut self,
        face: &BlockFace,
        lengths: Vec<TributaryLengths>,
    ) -> Result<(), NoColumn> {
        let geometry = self.geometry;
        let block = face.block;
        let upright = self.upright(face)?;
        let rock = self.rock(block);
        let outward = face.outward(geometry);
        let impedance = resistance(&rock, &outward);
        let raised = geometry.axes(block)[upright].z > 0.0;
        for (node, slant, along) in lengths {
            let second = (face.direction() + 2) % 3 == upright;
            let [width, height] = [along[usize::from(!second)], along[usize::from(second)]];
            let width = slant * (width[0] + width[1]);
            let [low, high] = height.map(|length| width * length);
            let areas = if raised { [low, high] } else { [high, low] };
            let column = self.column(node, upright, raised)?;
            let found = self.columns[column].nodes.iter().position(|&other| other == node);
            let Some(level) = found.map(|level| self.columns[column].first + level) else {
                continue;
            };
            let resistance = impedance * (areas[0] + areas[1]);
            self.sides.push(SideNode { node, level, resistance, outward, areas });
        }
        Ok(())
    }

    /// Direction of the upright edge of a face, or the reason why the face has no column.
    fn upright(&self, face: &BlockFace) -> Result<usize, NoColumn> {
        let axes = self.geometry.axes(face.block);
        let is_upright = |d: &usize| axes[*d].z.abs() > 1.0 - 1e-12;
        let upright = (0..3).find(is_upright);
        let level = |d: usize| axes[d].z.abs() < 1e-9;
        match upright {
            Some(d) if d == face.direction() => Err(NoColumn::Level),
            Some(d) if (0..3).all(|e| e == d || level(e)) => Ok(d),
            _ => Err(NoColumn::Aslant),
        }
    }

    fn rock(&self, block: usize) -> Elastic {
        self.properties.materials[self.geometry.blocks[block].material as usize]
    }

    /// Number of the column behind a node. A missing column is added.
    fn column(&mut self, node: u32, upright: usize, raised: bool) -> Result<usize, NoColumn> {
        let (geometry, start) = (self.geometry, self.start);
        let (mut block, at) = geometry.locate(node as usize);
        let upwards = |up: bool| FaceId { direction: upright, upper: raised == up };
        while let Some(below) = start.beyond(block, upwards(false)) {
            block = below;
        }
        let n = geometry.topology(block).divisions();
        let on = |block: usize, level: usize| {
            let level = if raised { level } else { n - level };
            geometry.node(block, moved_to(at, upright, level)) as u32
        };
        if let Some(&column) = self.by_base.get(&on(block, 0)) {
            return Ok(column);
        }
        let continues =
            |block: usize, up: bool| geometry.nonconforming(block, upwards(up).number()).is_some();
        let (base, lowest) = (on(block, 0), self.rock(block));
        let levels = |block: usize| (0..=n).map(move |level| (block, level));
        let (blocks, segments) = self.stack(block, upwards(true));
        let nodes: Vec<u32> =
            blocks.iter().flat_map(|&block| levels(block)).map(|(b, level)| on(b, level)).collect();
        let top = blocks.last().copied().unwrap_or(block);
        if continues(block, false) || continues(top, true) {
            return Err(NoColumn::Unmatched);
        }
        let column = Column::new(nodes, segments, &lowest, *self.first);
        *self.first += column.nodes.len();
        self.columns.push(column);
        self.by_base.insert(base, self.columns.len() - 1);
        Ok(self.columns.len() - 1)
    }

    /// Blocks of a column from the lowest one up, and the segments between its levels.
    fn stack(&self, lowest: usize, top: FaceId) -> (Vec<usize>, Vec<ColumnSegment>) {
        let (geometry, start) = (self.geometry, self.start);
        let upright = top.direction;
        let (mut blocks, mut segments, mut end) = (Vec::new(), Vec::new(), (0, 0));
        let mut block = lowest;
        loop {
            blocks.push(block);
            let length = geometry.spacing(block, upright);
            let layer = |_| ColumnSegment::layer(&self.rock(block), length);
            segments.extend((0..geometry.topology(block).divisions()).map(layer));
            if !geometry.is_removed(block) {
                end = (blocks.len(), segments.len());
            }
            let Some(above) = start.beyond(block, top) else { break };
            segments.push(self.joint(if top.upper { block } else { above }, upright));
            block = above;
        }
        // The column ends at its highest block that has not been removed.
        blocks.truncate(end.0);
        segments.truncate(end.1);
        (blocks, segments)
    }

    /// Segment of the joint at the upper end of a block along an edge.
    fn joint(&self, block: usize, d: usize) -> ColumnSegment {
        let (geometry, properties) = (self.geometry, self.properties);
        let gap = geometry.gap_above(block, d);
        let joint = &properties.joints[usize::from(geometry.joint_above(block, d))];
        if let Some(layer) = joint.layer().filter(|_| gap > 0.0) {
            return ColumnSegment { block: false, ..ColumnSegment::layer(layer, gap) };
        }
        let SpringStiffness { normal, shear } = joint.stiffness();
        ColumnSegment { normal, shear, across: [0.0; 2], mass: 0.0, block: false }
    }
}

impl ColumnSegment {
    fn layer(rock: &Elastic, length: f64) -> Self {
        Self {
            normal: rock.p_modulus() / length,
            shear: rock.shear / length,
            across: [rock.lambda / length, rock.shear / length],
            mass: rock.density * length,
            block: true,
        }
    }
}

impl Column {
    fn new(nodes: Vec<u32>, segments: Vec<ColumnSegment>, base: &Elastic, first: usize) -> Self {
        let mut mass = vec![0.0; nodes.len()];
        for (i, segment) in segments.iter().enumerate() {
            mass[i] += segment.mass / 2.0;
            mass[i + 1] += segment.mass / 2.0;
        }
        let [p, s] = [base.p_speed(), base.s_speed()].map(|speed| base.density * speed);
        let (slots, squares) = (Vec::new(), Vec::new());
        let impedance = Vec3::new(s, s, p);
        Self { nodes, slots, segments, mass, impedance, first, squares }
    }
}
