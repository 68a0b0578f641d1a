//! Contacts as plain numbers, one row for each patch, one for each of its points, and one for two blocks
//! that may meet.

use nalgebra::{Vector2, Vector3};

use super::Saved;
use super::pairs::{settled, settled_numbers};
use crate::contact::{Bond, Both, Contacts, Near, Pair, Patch, Point, Release, Seated, Spot};
use crate::geometry::Vec3;
use crate::lanes::{LANES, Lanes};
use crate::law::{Mode, Traction};
use crate::model::Model;

const PATCH: usize = 28;
const POINT: usize = 27;
const NEAR: usize = 3;
const PAIR: usize = 6;
const NAMES: [&str; 6] = [
    "contact_joints",
    "contact_patches",
    "contact_points",
    "contact_near",
    "contact_travel",
    "contact_bonds",
];

/// Adds the contacts, if there is anything that a start would not have.
pub(super) fn save(contacts: &Contacts, saved: &mut Saved) {
    if *contacts == Contacts::new(contacts.joints.len(), contacts.travel.len()) {
        return;
    }
    let joints = contacts.joints.iter().flatten().map(|joint| f64::from(*joint as u8));
    let patches = contacts.patches.iter().flat_map(patch_numbers);
    let points = contacts.patches.iter().flat_map(|patch| &patch.points).flat_map(point_numbers);
    let near = contacts
        .near
        .iter()
        .flat_map(|Near { blocks: [a, b], until }| [f64::from(*a), f64::from(*b), *until]);
    // How many are near, so that none is missed.
    let known = if contacts.known { 1.0 + contacts.near.len() as f64 } else { 0.0 };
    let travel = std::iter::once(known).chain(contacts.travel.iter().flat_map(|lanes| lanes.0));
    let held =
        contacts.patches.iter().filter_map(|patch| Some((patch.blocks, patch.bond.as_ref()?)));
    let ended = contacts.ended.iter().map(|(blocks, bond)| (*blocks, bond));
    let bonds = held.chain(ended).flat_map(|(blocks, bond)| bond_numbers(blocks, bond));
    let arrays = [
        joints.collect(),
        patches.collect(),
        points.collect(),
        near.collect(),
        travel.collect(),
        bonds.collect(),
    ];
    for (name, array) in NAMES.into_iter().zip(arrays) {
        saved.arrays.insert(name.to_owned(), array);
    }
}

/// The contacts that were saved; `None` when the numbers are not those of this model.
pub(super) fn restore(model: &Model, saved: &Saved) -> Option<Contacts> {
    let mut contacts = model.contacts();
    let Some(joints) = saved.arrays.get(NAMES[0]) else { return Some(contacts) };
    let array = |at: usize| saved.arrays.get(NAMES[at]);
    let [patches, points] = [array(1), array(2)];
    let (joints, rest) = joints.as_chunks::<3>();
    let (patches, rest_patches) = patches?.as_chunks::<PATCH>();
    let (points, rest_points) = points?.as_chunks::<POINT>();
    let whole = [rest.len(), rest_patches.len(), rest_points.len()] == [0; 3];
    if !whole || joints.len() != model.n_blocks() {
        return None;
    }
    contacts.patches.clear();
    for (known, numbers) in contacts.joints.iter_mut().zip(joints) {
        for (known, &number) in known.iter_mut().zip(numbers) {
            let all = [Release::Holds, Release::Loose, Release::Due, Release::Done];
            *known = *all.iter().find(|release| f64::from(**release as u8) == number)?;
        }
    }
    // Of a run that has diverged nothing is left of forces and gaps.
    let diverged = !saved.arrays.get("displacement")?.iter().all(|u| u.is_finite());
    let sound = |numbers: &[f64]| diverged || numbers.iter().all(|x| x.is_finite());
    let mut points = points.iter();
    for numbers in patches {
        let (mut patch, count) = patch(numbers).filter(|_| sound(numbers))?;
        let mut axes = patch.axes.into_iter().chain(patch.seen.map(|axis| axis.map(f64::from)));
        if !diverged && axes.any(|axis| (axis.norm_squared() - 1.0).abs() > 1e-6) {
            return None;
        }
        let [a, b] = patch.blocks;
        if a >= b || b as usize >= model.n_blocks() || count > points.len() {
            return None;
        }
        let mut read = Vec::with_capacity(count);
        for numbers in points.by_ref().take(count) {
            let point = point(numbers, diverged).filter(|_| sound(numbers))?;
            if !(0..2).all(|s| is_on(model, patch.blocks[s], &point.spots[s])) {
                return None;
            }
            read.push(point);
        }
        patch.points = read.into();
        contacts.patches.push(patch);
    }
    let sorted = contacts.patches.windows(2).all(|pair| pair[0].blocks < pair[1].blocks);
    contacts.index();
    search(&mut contacts, array(3)?, array(4)?, diverged)?;
    bonds(&mut contacts, array(5)?, &model.seated)?;
    (sorted && points.next().is_none()).then_some(contacts)
}

/// Blocks that may meet, and how far they have gone.
fn search(contacts: &mut Contacts, near: &[f64], travel: &[f64], diverged: bool) -> Option<()> {
    let (near, rest) = near.as_chunks::<NEAR>();
    let (known, travel) = travel.split_first()?;
    let (travel, rest_travel) = travel.as_chunks::<LANES>();
    let sound = |x: &f64| diverged || x.is_finite();
    let whole_rows = rest.is_empty() && rest_travel.is_empty();
    if !whole_rows
        || travel.len() != contacts.travel.len()
        || !travel.as_flattened().iter().all(sound)
    {
        return None;
    }
    for &[a, b, until] in near {
        let blocks = [whole(a)?, whole(b)?];
        let valid = blocks[0] < blocks[1] && (blocks[1] as usize) < contacts.joints.len();
        contacts
            .near
            .push(Near { blocks, until: Some(until).filter(|until| valid && sound(until))? });
    }
    contacts.known = *known != 0.0;
    if contacts.known && *known != 1.0 + near.len() as f64 {
        return None;
    }
    contacts.travel = travel.iter().map(|lanes| Lanes(*lanes)).collect();
    let sorted = contacts.near.windows(2).all(|pair| pair[0].blocks < pair[1].blocks);
    let apart = contacts.near.iter().all(|near| contacts.place(near.blocks).is_err());
    (sorted && apart).then_some(())
}

/// Blocks, how far the joint has come; then each pair.
fn bond_numbers([a, b]: [u32; 2], bond: &Bond) -> Vec<f64> {
    let Bond { release, pairs, .. } = bond;
    let mut numbers = vec![f64::from(a), f64::from(b), f64::from(*release as u8)];
    for Pair { origin, mode, time, damage } in pairs {
        let mode = mode.map_or(0.0, |mode| if mode == Mode::Shear { 1.0 } else { 2.0 });
        numbers.extend([origin.x, origin.y, origin.z, mode, *time, *damage]);
    }
    numbers
}

/// What holds the joints between faces that do not match, of which there are as many as at the start.
fn bonds(contacts: &mut Contacts, mut numbers: &[f64], seated: &[Seated]) -> Option<()> {
    let mut count = 0;
    while let Some((&[a, b, release], rest)) = numbers.split_first_chunk::<3>() {
        let blocks = [whole(a)?, whole(b)?];
        let start = seated.binary_search_by_key(&blocks, |seated| seated.patch.blocks).ok()?;
        let start = &seated[start].patch;
        let (pairs, rest) = rest.split_at_checked(PAIR * start.points.len())?;
        let pairs: Option<Box<[Pair]>> = pairs.as_chunks::<PAIR>().0.iter().map(pair).collect();
        let known = [Release::Holds, Release::Loose, Release::Done];
        let release = known.into_iter().find(|&known| f64::from(known as u8) == release)?;
        let joint = start.bond.as_ref()?.joint;
        let bond = Box::new(Bond { joint, law: joint, release, pairs: pairs? });
        if release == Release::Done {
            contacts.ended.push((blocks, bond));
        } else {
            let at = contacts.place(blocks).ok()?;
            let patch = &mut contacts.patches[at];
            patch.bond = Some(bond).filter(|bond| bond.pairs.len() == patch.points.len());
            patch.bond.as_ref()?;
        }
        (numbers, count) = (rest, count + 1);
    }
    (numbers.is_empty() && count == seated.len()).then_some(())
}

fn pair(&[x, y, z, mode, time, damage]: &[f64; PAIR]) -> Option<Pair> {
    let modes = [None, Some(Mode::Shear), Some(Mode::Tension)];
    let mode = *modes.get(whole(mode)? as usize)?;
    Some(Pair { origin: Vec3::new(x, y, z), mode, time, damage })
}

fn is_on(model: &Model, block: u32, spot: &Spot) -> bool {
    let n = model.geometry.lattice(block as usize).divisions;
    spot.element.iter().all(|&i| usize::from(i) < n)
}

fn patch_numbers(patch: &Patch) -> [f64; PATCH] {
    let Patch { blocks, faces, reference, axes, seen, apart, limit, both, .. } = patch;
    let [a, b] = blocks.map(f64::from);
    let [[n0, n1, n2], [t0, t1, t2]] = axes.map(<[f64; 3]>::from);
    let [[o0, o1, o2], [p0, p1, p2]] = seen.map(|axis| <[f64; 3]>::from(axis.map(f64::from)));
    let [f, g] = faces.map(f64::from);
    let [x, y, z] = (*apart).into();
    let Both { skin, stiffness: [kn, ks], tan_friction, dashpot } = *both;
    let reference = f64::from(*reference);
    let count = patch.points.len() as f64;
    [
        a,
        b,
        reference,
        n0,
        n1,
        n2,
        t0,
        t1,
        t2,
        o0,
        o1,
        o2,
        p0,
        p1,
        p2,
        x,
        y,
        z,
        f64::from(*limit),
        f,
        g,
        skin,
        kn,
        ks,
        tan_friction,
        dashpot,
        patch.bank,
        count,
    ]
}

/// A patch without its points, and how many these are.
fn patch(numbers: &[f64; PATCH]) -> Option<(Patch, usize)> {
    let three = |at: usize| Vec3::new(numbers[at], numbers[at + 1], numbers[at + 2]);
    let patch = Patch {
        blocks: [whole(numbers[0])?, whole(numbers[1])?],
        reference: u8::try_from(whole(numbers[2])?).ok().filter(|&side| side < 2)?,
        axes: [three(3), three(6)],
        seen: [three(9), three(12)].map(|axis: Vector3<f64>| axis.map(|x| x as f32)),
        apart: three(15),
        limit: numbers[18] as f32,
        faces: [face(numbers[19])?, face(numbers[20])?],
        both: Both {
            skin: numbers[21],
            stiffness: [numbers[22], numbers[23]],
            tan_friction: numbers[24],
            dashpot: numbers[25],
        },
        bank: numbers[26],
        ..Patch::default()
    };
    let sizes = [numbers[18], numbers[22], numbers[23]].iter().all(|&size| size > 0.0);
    let rest = [numbers[21], numbers[24], numbers[25], numbers[26]].iter().all(|&x| x >= 0.0);
    (sizes && rest).then_some((patch, whole(numbers[27])? as usize))
}

/// The number of a face.
fn face(number: f64) -> Option<u8> {
    u8::try_from(whole(number)?).ok().filter(|&face| face < 6)
}

/// A whole number that is not negative.
fn whole(number: f64) -> Option<u32> {
    let fits = number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number);
    fits.then_some(number as u32)
}

fn point_numbers(point: &Point) -> [f64; POINT] {
    let Point {
        spots: [a, b],
        area,
        slip,
        offset: [offset, lifted],
        gap,
        traction,
        drag: [drag, settling],
        account,
        slid,
        settled,
    } = *point;
    let [known, s, t, d, part, at] = settled_numbers(settled);
    let [[i, k, x, y], [j, l, u, v]] = [a, b].map(|spot| {
        let Spot { element: [i, k], on: [x, y] } = spot;
        [f64::from(i), f64::from(k), f64::from(x), f64::from(y)]
    });
    let Traction { normal, shear } = traction;
    [
        i, k, x, y, j, l, u, v, area, slip.x, slip.y, offset, lifted, gap, normal, shear.x,
        shear.y, drag, settling, account, slid, known, s, t, d, part, at,
    ]
}

/// Where a point lies within its elements may not be known in a run that has diverged.
fn point(numbers: &[f64; POINT], diverged: bool) -> Option<Point> {
    let spot = |at: usize| {
        let [i, k] = [numbers[at], numbers[at + 1]].map(whole);
        let on = [numbers[at + 2], numbers[at + 3]];
        let inside = on.iter().all(|on| (0.0..=1.0).contains(on));
        (inside || diverged).then_some(Spot {
            element: [u16::try_from(i?).ok()?, u16::try_from(k?).ok()?],
            on: on.map(|x| x as f32),
        })
    };
    let [
        area,
        slip_x,
        slip_y,
        offset,
        lifted,
        gap,
        normal,
        shear_x,
        shear_y,
        drag,
        settling,
        account,
        slid,
    ] = std::array::from_fn(|k| numbers[8 + k]);
    let point = Point {
        spots: [spot(0)?, spot(4)?],
        area,
        slip: Vector2::new(slip_x, slip_y),
        offset: [offset, lifted],
        gap,
        traction: Traction { normal, shear: Vector2::new(shear_x, shear_y) },
        drag: [drag, settling],
        account,
        slid,
        settled: settled(std::array::from_fn(|k| numbers[21 + k])),
    };
    (area >= 0.0 || diverged).then_some(point)
}
