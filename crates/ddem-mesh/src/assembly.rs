//! Assembly of blocks into tables: elements of blocks and joint cells, lumped masses, eq. (3), and
//! the diagonal of the assembled stiffness, eq. (8) and eq. (11).

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::Geometry;
use crate::bodies::{CellBodies, corner_arms};
use crate::inertia::Inertia;
use crate::joint_sections::JointSections;
use crate::pack::{Pack, Packs};
use crate::properties::Properties;
use ddem_mechanics::element::Elastic;
use ddem_mechanics::element::ElementKind;
use ddem_mechanics::element::modal::Modal;
use ddem_mechanics::element::table::ElementTable;
use ddem_mechanics::math::lanes::{LANES, Lanes};
use ddem_mechanics::rigid::{CornerArms, MassProperties};

/// Marker for no table: none of the four lanes has such a cell.
pub const NO_TABLE: u32 = u32::MAX;

/// Parallelepiped of one material, shared by all equal elements.
#[derive(Clone, Debug)]
pub struct Element {
    /// Edge vectors `[m]`.
    pub edges: [Vector3<f64>; 3],
    /// Volume `[m³]`.
    pub volume: f64,
    /// Elastic constants and density.
    pub elastic: Elastic,
    /// Modal stiffness.
    pub modal: Modal,
    /// Diagonal of the stiffness by node (x fastest) and component `[N/m]`.
    diagonal: [[f64; 3]; 8],
}

/// Four elements side by side.
#[derive(Clone, Debug)]
pub struct ElementPack {
    /// Edge vectors of one element `[m]`, any with a volume in lanes without one.
    pub edges: [[Lanes; 3]; 3],
    /// Stiffness of the four elements.
    pub table: ElementTable,
    /// Index of the element in each lane. Of a part only its material is that of this element.
    pub elements: [Option<u32>; LANES],
    /// Deviations of the nodes from those of the parallelepipeds `[m]`; empty without any.
    pub warp: Vec<[Lanes; 3]>,
    /// Part of the inertia of each lane that has weight.
    pub weight: Lanes,
}

/// Data shared by equal packs.
#[derive(Clone, Debug, Default)]
pub struct Assembly {
    /// Distinct elements.
    pub elements: Vec<Element>,
    /// Distinct combinations of four elements side by side.
    pub tables: Vec<ElementPack>,
    /// Distinct masses of packs.
    pub inertia: Vec<Inertia>,
    /// Tables of each pack, for its blocks (0) and its joint lattices (1…7).
    pub pack_tables: Vec<[u32; 8]>,
    /// True for the offsets of upper neighbours on which any joint exerts forces.
    pub loaded_neighbours: [bool; 8],
    /// Index of the inertia of each pack.
    pub pack_inertia: Vec<u32>,
    /// Mass properties of the rigid blocks, for each rigid pack; lanes without a block repeat the
    /// first one.
    pub rigid: Vec<[MassProperties; LANES]>,
    /// Arms of their corners.
    pub arms: Vec<CornerArms>,
    /// Rigid bodies of several blocks.
    pub bodies: CellBodies,
    element_index: HashMap<(ElementKind, [u64; 12]), u32>,
    table_index: HashMap<[Option<u32>; LANES], u32>,
}

impl Assembly {
    /// Tables of all packs; [`assemble`](Self::assemble) adds the masses.
    pub fn new(geometry: &Geometry, packs: &Packs, properties: &Properties) -> Self {
        let mut assembly = Self::default();
        for pack in &packs.packs {
            if geometry.part(pack.blocks[0] as usize).is_some() {
                let tables = assembly.tables_of_parts(geometry, properties, pack);
                assembly.pack_tables.push(tables);
                continue;
            }
            let is_box = geometry.lattice(pack.blocks[0] as usize).is_box();
            let tables = std::array::from_fn(|offset| {
                let lanes = std::array::from_fn(|lane| {
                    let block = (lane < pack.filled).then_some(pack.blocks[lane] as usize)?;
                    assembly.cell(geometry, properties, block, offset)
                });
                assembly.table(lanes, is_box)
            });
            assembly.pack_tables.push(tables);
        }
        assembly
    }

    /// Element of a block (offset 0) or of its joint lattice at an offset, if it exists.
    fn cell(
        &mut self,
        geometry: &Geometry,
        properties: &Properties,
        block: usize,
        offset: usize,
    ) -> Option<u32> {
        let lattice = geometry.lattice(block);
        let cell = geometry.blocks[block].cell.map(|c| c as usize);
        // Incompatible modes in a layer would cancel the shear of slip that varies along it.
        let (elastic, kind) = if offset == 0 {
            (properties.materials[geometry.blocks[block].material as usize], properties.element)
        } else {
            (*joint_material(geometry, properties, block, offset)?, ElementKind::Standard)
        };
        let length = |d: usize| {
            if offset & (1 << d) == 0 {
                lattice.spacing(d, cell[d])
            } else {
                lattice.gaps[d][cell[d] + 1]
            }
        };
        let edges = [0, 1, 2].map(|d| lattice.axes[d] * length(d));
        Some(self.element(edges, elastic, kind))
    }

    pub(crate) fn element(
        &mut self,
        edges: [Vector3<f64>; 3],
        elastic: Elastic,
        kind: ElementKind,
    ) -> u32 {
        let mut key = [0; 12];
        let constants = [elastic.lambda, elastic.shear, elastic.density];
        let numbers = edges.iter().flat_map(|e| e.iter()).chain(&constants);
        key.iter_mut().zip(numbers).for_each(|(k, x)| *k = x.to_bits());
        let elements = &mut self.elements;
        *self.element_index.entry((kind, key)).or_insert_with(|| {
            elements.push(Element::new(edges, elastic, kind));
            elements.len() as u32 - 1
        })
    }

    fn table(&mut self, lanes: [Option<u32>; LANES], is_box: bool) -> u32 {
        let Some(first) = lanes.iter().flatten().next() else { return NO_TABLE };
        if let Some(&table) = self.table_index.get(&lanes) {
            return table;
        }
        let of = |lane: usize| lanes[lane].map(|e| &self.elements[e as usize]);
        let table = ElementTable::new(std::array::from_fn(|l| of(l).map(|e| &e.modal)), is_box);
        let shape = |lane: usize| of(lane).unwrap_or(&self.elements[*first as usize]);
        let edges = std::array::from_fn(|d| {
            std::array::from_fn(|k| Lanes(std::array::from_fn(|lane| shape(lane).edges[d][k])))
        });
        self.tables.push(ElementPack {
            edges,
            table,
            elements: lanes,
            warp: Vec::new(),
            weight: Lanes([1.0; LANES]),
        });
        self.table_index.insert(lanes, self.tables.len() as u32 - 1);
        self.tables.len() as u32 - 1
    }

    /// Removes the joint elements of rigid blocks, of which only the mass counts.
    fn remove_joint_elements(&mut self, packs: &Packs) {
        for (tables, _) in self.pack_tables.iter_mut().zip(&packs.packs).filter(|(_, p)| p.rigid) {
            tables[1..].fill(NO_TABLE);
        }
    }

    /// Sums mass and stiffness over the elements at each node. `bonds` has those of nonconforming
    /// joints by node; it is empty without such joints.
    pub fn assemble(
        &mut self,
        geometry: &Geometry,
        packs: &Packs,
        properties: &Properties,
        sections: &JointSections,
        bonds: &[[f64; 4]],
    ) {
        // Mass of each node and its three diagonal stiffnesses.
        let mut nodes = vec![[0.0; 4]; geometry.n_nodes];
        for (pack, tables) in packs.packs.iter().zip(&self.pack_tables) {
            let offsets = (0..8).filter(|&offset| tables[offset] != NO_TABLE);
            for (offset, lane) in offsets.flat_map(|o| (0..pack.filled).map(move |l| (o, l))) {
                let table = &self.tables[tables[offset] as usize];
                let removed = geometry.is_removed(pack.blocks[lane] as usize);
                if !removed && !table.warp.is_empty() {
                    geometry.scatter_part(pack.blocks[lane] as usize, properties, &mut nodes);
                    continue;
                }
                if let Some(element) = table.elements[lane].filter(|_| !removed) {
                    let element = &self.elements[element as usize];
                    scatter(geometry, packs, pack, offset, lane, element, &mut nodes);
                }
            }
        }
        for at in 0..3 * packs.packs.len() {
            scatter_springs(geometry, packs, sections, at / 3, at % 3, &mut nodes);
        }
        for (node, more) in nodes.iter_mut().zip(bonds) {
            (0..4).for_each(|k| node[k] += more[k]);
        }
        for pack in packs.packs.iter().filter(|pack| pack.rigid) {
            self.rigid.push(rigid_matter(geometry, pack, &mut nodes));
        }
        self.unite_bodies(geometry, packs, properties, bonds);
        self.arms = corner_arms(&self.rigid);
        let tied = geometry.summed_over_ties(&nodes);
        let mut index = HashMap::new();
        for pack in &packs.packs {
            let divisions = packs.numbering_of(pack).divisions;
            let mut inertia = Inertia::gather(geometry, divisions, pack, &nodes);
            if !tied.is_empty() {
                inertia.tie(geometry, divisions, pack, &tied);
            }
            let key: Vec<u64> = inertia.numbers().map(f64::to_bits).collect();
            let list = &mut self.inertia;
            self.pack_inertia.push(*index.entry(key).or_insert_with(|| {
                list.push(inertia);
                list.len() as u32 - 1
            }));
        }
        self.remove_joint_elements(packs);
        self.loaded_neighbours = sections.loaded_neighbours(&self.pack_tables);
    }
}

/// Mass properties of the rigid blocks of a pack. The corners get equal masses, so that the
/// centroid is the centre of mass, but not those of parts of cells.
fn rigid_matter(
    geometry: &Geometry,
    pack: &Pack,
    nodes: &mut [[f64; 4]],
) -> [MassProperties; LANES] {
    let mass_properties = |block: u32| {
        let block = block as usize;
        let edges = geometry.element_edges(block);
        let first = geometry.blocks[block].first_node as usize;
        let mut sum = [0.0; 4];
        for node in &nodes[first..first + 8] {
            (0..4).for_each(|k| sum[k] += node[k]);
        }
        // A removed block never moves, for any mass.
        let mass = if geometry.is_removed(block) { 1.0 } else { sum[0] };
        MassProperties::new(mass, edges, Vector3::new(sum[1], sum[2], sum[3]))
    };
    let mass_properties = pack.blocks.map(mass_properties);
    let bodies = pack.blocks[..pack.filled].iter().zip(&mass_properties);
    for (&block, mass_properties) in
        bodies.filter(|(block, _)| is_alone(geometry, **block as usize))
    {
        let first = geometry.blocks[block as usize].first_node as usize;
        nodes[first..first + 8].iter_mut().for_each(|node| node[0] = mass_properties.mass / 8.0);
    }
    mass_properties
}

/// True for a block that exists and is no part of a cell.
fn is_alone(geometry: &Geometry, block: usize) -> bool {
    !geometry.is_removed(block) && geometry.part(block).is_none()
}

/// Elastic constants of a joint lattice: those of its joint or, if several joints meet, of the most
/// compliant one. `None` if a surrounding block is missing or a joint is not a layer.
fn joint_material<'a>(
    geometry: &Geometry,
    properties: &'a Properties,
    block: usize,
    offset: usize,
) -> Option<&'a Elastic> {
    let lattice = geometry.lattice(block);
    let cell = geometry.blocks[block].cell.map(|c| c as usize);
    let parts = || (0..8).filter(|part| part & !offset == 0);
    let step = |part: usize| [0, 1, 2].map(|d| i32::from(part & (1 << d) != 0));
    if !parts().all(|part| geometry.neighbour(block, step(part)).is_some()) {
        return None;
    }
    let mut softest: Option<&Elastic> = None;
    for part in parts() {
        let step = step(part);
        let at = [0, 1, 2].map(|d| cell[d] + step[d] as usize);
        for d in (0..3).filter(|d| offset & (1 << d) != 0 && part & (1 << d) == 0) {
            let joint = properties.joints[usize::from(lattice.joint_above(at, d))].layer()?;
            if lattice.gaps[d][cell[d] + 1] <= 0.0 {
                return None;
            }
            if softest.is_none_or(|s| joint.p_modulus() < s.p_modulus()) {
                softest = Some(joint);
            }
        }
    }
    softest
}

/// Adds mass and stiffness of the element in one lane to all nodes of its lattice.
fn scatter(
    geometry: &Geometry,
    packs: &Packs,
    pack: &Pack,
    offset: usize,
    lane: usize,
    element: &Element,
    nodes: &mut [[f64; 4]],
) {
    let numbering = packs.numbering_of(pack);
    let dims = numbering.dims(offset);
    let block = pack.blocks[lane] as usize;
    let first: [usize; 8] = std::array::from_fn(|part| {
        let step = [0, 1, 2].map(|d| i32::from(part & (1 << d) != 0));
        let other = if part & !offset == 0 { geometry.neighbour(block, step) } else { None };
        other.map_or(0, |b| geometry.blocks[b].first_node as usize)
    });
    let [nx, ny, nz] = dims.map(|n| n + 1);
    let cells = (0..dims[2])
        .flat_map(|k| (0..dims[1]).flat_map(move |j| (0..dims[0]).map(move |i| [i, j, k])));
    let mass = element.elastic.density * element.volume / 8.0;
    debug_assert!(offset == 0 || numbering.joints[offset].len() == nx * ny * nz);
    for [i, j, k] in cells {
        for corner in 0..8 {
            let at = i + (corner & 1) + nx * (j + (corner >> 1 & 1) + ny * (k + (corner >> 2)));
            let node = match numbering.joints[offset].get(at) {
                Some(node) => first[node.offset] + node.local,
                None => first[0] + at,
            };
            let sums = &mut nodes[node];
            sums[0] += mass;
            for c in (0..3).filter(|_| !pack.rigid) {
                sums[1 + c] += element.diagonal[corner][c];
            }
        }
    }
}

/// Adds the stiffness of a pack's joints across direction d that consist of springs from the start.
fn scatter_springs(
    geometry: &Geometry,
    packs: &Packs,
    sections: &JointSections,
    index: usize,
    d: usize,
    nodes: &mut [[f64; 4]],
) {
    let Some(section) = sections.get(index, d) else { return };
    let pack = &packs.packs[index];
    let numbering = packs.numbering_of(pack);
    for lane in (0..pack.filled).filter(|&lane| section.springs[lane]) {
        let a = pack.blocks[lane] as usize;
        let Some(b) = geometry.above(a, d) else { continue };
        let first = [a, b].map(|block| geometry.blocks[block].first_node as usize);
        for node_pair in &numbering.pairs[d] {
            for (side, first) in node_pair.sides.iter().zip(first) {
                let sums = &mut nodes[first + numbering.joints[1 << d][*side].local];
                for (c, k) in section.diagonal(lane).into_iter().enumerate() {
                    sums[1 + c] += k * node_pair.elements().len() as f64;
                }
            }
        }
    }
}

impl Element {
    fn new(edges: [Vector3<f64>; 3], elastic: Elastic, kind: ElementKind) -> Self {
        let modal = Modal::new(&edges, &elastic, kind);
        let dense = modal.dense();
        // From VTK order to x fastest.
        const VTK: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];
        let rows = VTK.map(|a| [0, 1, 2].map(|c| 3 * a + c));
        Self {
            edges,
            volume: edges[0].cross(&edges[1]).dot(&edges[2]).abs(),
            elastic,
            modal,
            diagonal: rows.map(|row| row.map(|r| dense[(r, r)])),
        }
    }
}

impl ElementPack {
    /// Memory in use `[bytes]`.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.table.bytes() + size_of_val(&self.warp[..])
    }

    /// Volume of the elements of a block in one lane `[m³]`, from the element of a lattice and their
    /// number.
    pub fn volume(&self, lane: usize, elements: &[Element], cells: usize) -> f64 {
        if let ElementTable::Hexahedra(tables) = &self.table {
            return tables.iter().filter_map(|table| table.volume(lane)).sum();
        }
        let element = self.elements[lane].map(|element| &elements[element as usize]);
        element.map_or(0.0, |element| cells as f64 * element.volume)
    }
}
