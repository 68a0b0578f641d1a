//! Broken joints as plain numbers, one for each pair.

use nalgebra::{Vector2, Vector3};

use super::Saved;
use crate::breaks::{Breaks, Broken, Point};
use crate::contact::{Contacts, Release};
use crate::law::{Memory, Mode, Settled, Traction};
use crate::model::Model;
use crate::pairs::face_places;

/// Names of the arrays, and numbers a pair.
const ARRAYS: [(&str, usize); 12] = [
    ("pair_mode", 1),
    ("pair_time", 1),
    ("pair_origin", 3),
    ("pair_slip", 2),
    ("pair_shear", 2),
    ("pair_normal", 1),
    ("pair_damage", 1),
    ("pair_gap", 3),
    ("pair_drag", 2),
    ("pair_account", 1),
    ("pair_settled", 3),
    ("pair_settled_at", 3),
];

/// Adds the broken joints, if there are any that a start would not have.
pub(super) fn save(model: &Model, breaks: &Breaks, saved: &mut Saved) {
    if *breaks == model.breaks() {
        return;
    }
    let mut arrays = ARRAYS.map(|(_, width)| vec![0.0; width * model.n_pairs()]);
    for (at, lane, first) in face_places(model) {
        let Some(broken) = breaks.get(at.0, 1 << at.1) else { continue };
        for (p, points) in broken.points.iter().enumerate() {
            let numbers = numbers(&points[lane], broken.times[p][lane]);
            for ((array, (_, width)), values) in arrays.iter_mut().zip(ARRAYS).zip(&numbers) {
                array[width * (first + p)..][..width].copy_from_slice(&values[..width]);
            }
        }
    }
    for ((name, _), array) in ARRAYS.iter().zip(arrays) {
        saved.arrays.insert((*name).to_owned(), array);
    }
}

/// The broken joints that were saved; `None` when the numbers are not those of this model.
pub(super) fn restore(model: &Model, saved: &Saved, contacts: &Contacts) -> Option<Breaks> {
    let Model { packs, assembly, seams, .. } = model;
    let mut breaks = model.breaks();
    if !saved.arrays.contains_key(ARRAYS[0].0) {
        return Some(breaks);
    }
    for (name, width) in ARRAYS {
        if saved.arrays.get(name)?.len() != width * model.n_pairs() {
            return None;
        }
    }
    let value = |array: usize, pair: usize| {
        let (name, width) = ARRAYS[array];
        &saved.arrays[name][width * pair..][..width]
    };
    // Failed pairs first: they say which elements are gone.
    for (at, lane, first) in face_places(model) {
        let shape = packs.shape_of(&packs.packs[at.0]);
        let places = &shape.pairs[at.1];
        let failed = |p: usize| value(0, first + p)[0] != 0.0;
        if !(0..places.len()).any(failed) {
            continue;
        }
        let tables = assembly.pack_tables[at.0];
        let broken = breaks.at(at.0)[1 << at.1]
            .get_or_insert_with(|| Broken::intact(packs, &packs.packs[at.0], tables, 1 << at.1));
        for p in (0..places.len()).filter(|&p| failed(p)) {
            broken.set_failed(places, p, lane);
        }
        broken.count(places, seams.get(at.0, at.1)?);
    }
    for (at, lane, first) in face_places(model) {
        let lattices = breaks.packs[at.0].as_mut();
        let Some(broken) = lattices.and_then(|lattices| lattices[1 << at.1].as_mut()) else {
            continue;
        };
        for (p, points) in broken.points.iter_mut().enumerate() {
            let numbers: [&[f64]; 12] = std::array::from_fn(|array| value(array, first + p));
            broken.times[p][lane] = numbers[1][0];
            set(&mut points[lane], numbers);
        }
        if contacts.joints[packs.packs[at.0].bodies[lane] as usize][at.1] == Release::Done {
            broken.let_go(lane);
        }
    }
    let cells = breaks.touched(packs, assembly);
    breaks.remove(packs, assembly, &cells);
    Some(breaks)
}

fn numbers(point: &Point, time: f64) -> [[f64; 3]; 12] {
    let Memory { slip, dilation, damage, gap, lifted, traction, drag, account, settled } =
        point.memory;
    let [known, x, y, d, part, at] = settled_numbers(settled);
    let mode = match point.mode {
        None => 0.0,
        Some(Mode::Shear) => 1.0,
        Some(Mode::Tension) => 2.0,
    };
    let one = |x: f64| [x, 0.0, 0.0];
    [
        one(mode),
        one(time),
        point.origin.into(),
        [slip.x, slip.y, 0.0],
        [traction.shear.x, traction.shear.y, 0.0],
        one(traction.normal),
        one(damage),
        [gap, dilation, lifted],
        [drag[0], drag[1], 0.0],
        one(account),
        [known, x, y],
        [d, part, at],
    ]
}

fn set(point: &mut Point, numbers: [&[f64]; 12]) {
    let [mode, _, origin, slip, shear, normal, damage, gap, drag, account, known, at] = numbers;
    point.mode = match mode[0] {
        1.0 => Some(Mode::Shear),
        2.0 => Some(Mode::Tension),
        _ => None,
    };
    let in_plane = |v: &[f64]| Vector2::new(v[0], v[1]);
    point.origin = Vector3::new(origin[0], origin[1], origin[2]);
    point.memory = Memory {
        slip: in_plane(slip),
        dilation: gap[1],
        damage: damage[0],
        gap: gap[0],
        lifted: gap[2],
        traction: Traction { normal: normal[0], shear: in_plane(shear) },
        drag: [drag[0], drag[1]],
        account: account[0],
        settled: settled([known[0], known[1], known[2], at[0], at[1], at[2]]),
    };
}

/// The last equilibrium as numbers, the first of them 1 where there is one.
pub(super) fn settled_numbers(settled: Option<Settled>) -> [f64; 6] {
    settled.map_or([0.0; 6], |Settled { slip, dilation, damage, gap }| {
        [1.0, slip.x, slip.y, dilation, damage, gap]
    })
}

/// The inverse of [`settled_numbers`].
pub(super) fn settled([known, x, y, dilation, damage, gap]: [f64; 6]) -> Option<Settled> {
    (known != 0.0).then_some(Settled { slip: Vector2::new(x, y), dilation, damage, gap })
}
