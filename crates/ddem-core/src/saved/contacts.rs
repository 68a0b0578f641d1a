//! Contacts as plain numbers, one row for each patch and one for each of its points.

use nalgebra::Vector2;

use super::Saved;
use crate::contact::{Both, Contacts, Patch, Point, Release, Spot};
use crate::geometry::Vec3;
use crate::law::{Memory, Traction};
use crate::model::Model;

const PATCH: usize = 28;
const POINT: usize = 21;
const NAMES: [&str; 3] = ["contact_joints", "contact_patches", "contact_points"];

/// Adds the contacts, if there is anything that a start would not have.
pub(super) fn save(contacts: &Contacts, saved: &mut Saved) {
    if *contacts == Contacts::new(contacts.joints.len()) {
        return;
    }
    let joints = contacts.joints.iter().flatten().map(|joint| f64::from(*joint as u8));
    let patches = contacts.patches.iter().flat_map(patch_numbers);
    let points = contacts.patches.iter().flat_map(|patch| &patch.points).flat_map(point_numbers);
    let arrays = [joints.collect(), patches.collect(), points.collect()];
    for (name, array) in NAMES.into_iter().zip(arrays) {
        saved.arrays.insert(name.to_owned(), array);
    }
}

/// The contacts that were saved; `None` when the numbers are not those of this model.
pub(super) fn restore(model: &Model, saved: &Saved) -> Option<Contacts> {
    let mut contacts = Contacts::new(model.n_blocks());
    let Some(joints) = saved.arrays.get(NAMES[0]) else { return Some(contacts) };
    let [patches, points] = [NAMES[1], NAMES[2]].map(|name| saved.arrays.get(name));
    let (joints, rest) = joints.as_chunks::<3>();
    let (patches, rest_patches) = patches?.as_chunks::<PATCH>();
    let (points, rest_points) = points?.as_chunks::<POINT>();
    let whole = [rest.len(), rest_patches.len(), rest_points.len()] == [0; 3];
    if !whole || joints.len() != model.n_blocks() {
        return None;
    }
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
        let mut axes = patch.axes.iter().chain(&patch.seen);
        if !diverged && axes.any(|axis| (axis.norm_squared() - 1.0).abs() > 1e-9) {
            return None;
        }
        let [a, b] = patch.blocks;
        if a >= b || b as usize >= model.n_blocks() || count > points.len() {
            return None;
        }
        for numbers in points.by_ref().take(count) {
            let point = point(numbers, diverged).filter(|_| sound(numbers))?;
            if !(0..2).all(|s| is_on(model, patch.blocks[s], &point.spots[s])) {
                return None;
            }
            patch.points.push(point);
        }
        contacts.patches.push(patch);
    }
    let sorted = contacts.patches.windows(2).all(|pair| pair[0].blocks < pair[1].blocks);
    contacts.index();
    (sorted && points.next().is_none()).then_some(contacts)
}

fn is_on(model: &Model, block: u32, spot: &Spot) -> bool {
    let n = model.geometry.lattice(block as usize).divisions;
    spot.face < 6 && spot.element.iter().all(|&i| usize::from(i) < n)
}

fn patch_numbers(patch: &Patch) -> [f64; PATCH] {
    let Patch { blocks, reference, axes, seen, apart, limit, lever, spacing, both, .. } = patch;
    let [a, b] = blocks.map(f64::from);
    let [[n0, n1, n2], [t0, t1, t2]] = axes.map(<[f64; 3]>::from);
    let [[o0, o1, o2], [p0, p1, p2]] = seen.map(<[f64; 3]>::from);
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
        *limit,
        *lever,
        *spacing,
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
        seen: [three(9), three(12)],
        apart: three(15),
        limit: numbers[18],
        lever: numbers[19],
        spacing: numbers[20],
        both: Both {
            skin: numbers[21],
            stiffness: [numbers[22], numbers[23]],
            tan_friction: numbers[24],
            dashpot: numbers[25],
        },
        bank: numbers[26],
        ..Patch::default()
    };
    let sizes = [&numbers[18..=20], &numbers[22..=23]];
    let sizes = sizes.iter().all(|sizes| sizes.iter().all(|&size| size > 0.0));
    let rest = [numbers[21], numbers[24], numbers[25], numbers[26]].iter().all(|&x| x >= 0.0);
    (sizes && rest).then_some((patch, whole(numbers[27])? as usize))
}

/// A whole number that is not negative.
fn whole(number: f64) -> Option<u32> {
    let fits = number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number);
    fits.then_some(number as u32)
}

fn point_numbers(point: &Point) -> [f64; POINT] {
    let Point { spots: [a, b], area, memory, drag, .. } = point;
    let Memory { slip, dilation, damage, gap, lifted, traction } = *memory;
    let [[f, i, k, x, y], [g, j, l, u, v]] = [a, b].map(|spot| {
        let Spot { face, element: [i, k], on: [x, y] } = *spot;
        [f64::from(face), f64::from(i), f64::from(k), f64::from(x), f64::from(y)]
    });
    let Traction { normal, shear } = traction;
    [
        f, i, k, x, y, g, j, l, u, v, *area, slip.x, slip.y, dilation, damage, gap, lifted, normal,
        shear.x, shear.y, *drag,
    ]
}

/// Where a point lies within its elements may not be known in a run that has diverged.
fn point(numbers: &[f64; POINT], diverged: bool) -> Option<Point> {
    let spot = |at: usize| {
        let [i, k] = [numbers[at + 1], numbers[at + 2]].map(whole);
        let on = [numbers[at + 3], numbers[at + 4]];
        let inside = on.iter().all(|on| (0.0..=1.0).contains(on));
        (inside || diverged).then_some(Spot {
            face: u8::try_from(whole(numbers[at])?).ok()?,
            element: [u16::try_from(i?).ok()?, u16::try_from(k?).ok()?],
            on: on.map(|x| x as f32),
        })
    };
    let [slip_x, slip_y, dilation, damage, gap, lifted, normal, shear_x, shear_y, drag] =
        std::array::from_fn(|k| numbers[11 + k]);
    let memory = Memory {
        slip: Vector2::new(slip_x, slip_y),
        dilation,
        damage,
        gap,
        lifted,
        traction: Traction { normal, shear: Vector2::new(shear_x, shear_y) },
    };
    let area = numbers[10];
    let spots = [spot(0)?, spot(5)?];
    (area >= 0.0 || diverged).then_some(Point { spots, area, memory, drag, ..Point::default() })
}
