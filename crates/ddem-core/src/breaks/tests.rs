//! Which strips and corners go with a pair, against all cells that hold both its nodes.

use std::collections::BTreeSet;

use super::Broken;
use super::strips::Cell;
use crate::assembly::NO_TABLE;
use crate::deck::{BlockSet, Deck, Extent, Joint, JointChoice, Material, Remove, Where};
use crate::geometry::NO_JOINT;
use crate::lanes::LANES;
use crate::model::Model;

/// Pack, lane and local number of a node.
type Node = (usize, usize, usize);

fn model(count: [u32; 3], divisions: u32, gone: Option<[f64; 3]>) -> Model {
    let rock = Material { density: 2400.0, young: 18e9, poisson: 0.25 };
    let seam = Joint { thickness: 0.02, material: Some("rock".into()), ..Joint::default() };
    let around = |at: f64| Some(Extent::Range([at - 0.4, at + 0.4]));
    let remove = gone.map(|[x, y, z]| Remove {
        region: Where { x: around(x), y: around(y), z: around(z), ..Where::default() },
        ..Remove::default()
    });
    let deck = Deck {
        materials: [("rock".to_owned(), rock)].into(),
        joints: [("seam".to_owned(), seam)].into(),
        blocks: vec![BlockSet {
            size: Some(count.map(f64::from)),
            count: Some(count),
            divisions,
            material: "rock".into(),
            joint: Some(JointChoice::All("seam".into())),
            ..BlockSet::default()
        }],
        remove: remove.into_iter().collect(),
        ..Deck::default()
    };
    Model::new(&deck).unwrap_or_else(|error| panic!("{error}"))
}

/// A node of a joint lattice, given by its place there.
fn node(model: &Model, pack: usize, lane: usize, offset: usize, place: usize) -> Node {
    let packs = &model.packs;
    let node = packs.shape_of(&packs.packs[pack]).joints[offset][place];
    let upper = packs.packs[pack].upper[node.offset].at(lane);
    let (pack, lane) = if node.offset == 0 { (pack, lane) } else { upper.expect("a neighbour") };
    (pack, lane, node.local)
}

/// All strip and corner elements with their eight nodes.
fn cells(model: &Model) -> Vec<(Cell, Vec<Node>)> {
    let mut cells = Vec::new();
    for pack in 0..model.packs.packs.len() {
        for (offset, lane) in [3, 5, 6, 7].into_iter().flat_map(|o| (0..LANES).map(move |l| (o, l)))
        {
            let table = model.assembly.pack_tables[pack][offset];
            if table == NO_TABLE || model.assembly.tables[table as usize].elements[lane].is_none() {
                continue;
            }
            let [nx, ny, nz] = model.packs.shape_of(&model.packs.packs[pack]).dims(offset);
            for element in 0..nx * ny * nz {
                let at = [element % nx, element / nx % ny, element / (nx * ny)];
                let corner = |c: usize| {
                    let [x, y, z] = [at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)];
                    node(model, pack, lane, offset, x + (nx + 1) * (y + (ny + 1) * z))
                };
                cells.push(((pack, offset, element, lane), (0..8).map(corner).collect()));
            }
        }
    }
    cells
}

#[test]
fn strips_and_corners_that_hold_both_nodes_go_with_a_pair() {
    let lattices = [
        ([3, 3, 3], 2, None),
        ([4, 2, 3], 1, None),
        ([2, 3, 4], 3, Some([0.5, 1.5, 2.5])),
        ([3, 3, 3], 2, Some([1.5, 1.5, 1.5])),
    ];
    for (count, divisions, gone) in lattices {
        let model = model(count, divisions, gone);
        let (packs, assembly) = (&model.packs, &model.assembly);
        let all = cells(&model);
        let mut removed = 0;
        for (pack, d) in (0..packs.packs.len()).flat_map(|pack| (0..3).map(move |d| (pack, d))) {
            let Some(seam) = model.seams.get(pack, d) else { continue };
            let places = &packs.shape_of(&packs.packs[pack]).pairs[d];
            for lane in (0..LANES).filter(|&lane| seam.joints[lane] != NO_JOINT) {
                for (p, place) in places.iter().enumerate() {
                    let ends = place.sides.map(|side| node(&model, pack, lane, 1 << d, side));
                    let holds = |(_, nodes): &&(Cell, Vec<Node>)| {
                        ends.iter().all(|end| nodes.contains(end))
                    };
                    let expected: BTreeSet<Cell> =
                        all.iter().filter(holds).map(|(cell, _)| *cell).collect();
                    let mut breaks = model.breaks();
                    let tables = assembly.pack_tables[pack];
                    let mut lattice = Broken::intact(packs, &packs.packs[pack], tables, 1 << d);
                    lattice.set_failed(places, p, lane);
                    breaks.at(pack)[1 << d] = Some(lattice);
                    let found: BTreeSet<Cell> =
                        breaks.touched(packs, assembly).into_iter().collect();
                    assert_eq!(
                        found, expected,
                        "pack {pack}, direction {d}, lane {lane}, pair {p}"
                    );
                    removed += found.len();
                }
            }
        }
        assert!(removed > 0, "{count:?}");
    }
}
