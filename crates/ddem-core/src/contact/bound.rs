//! §6: how stiff contacts can make a model.
//!
//! Contacts come and go, so that the largest eigenvalue of `M⁻¹K` with them is bounded instead of
//! computed: two blocks in contact are at most twice as stiff as one against ground that stands still,
//! and a block is stiffest with contacts on all its faces.

use nalgebra::{Matrix3, Matrix6};

use super::Skins;
use crate::assembly::Assembly;
use crate::geometry::{Geometry, Vec3};
use crate::law::Stiffness;
use crate::pack::Packs;
use crate::rigid::Matter;
use crate::touch::FaceOf;

/// Most that contacts add to the square of the largest angular frequency of deformable blocks, and
/// the square of that of rigid ones with all their joints and contacts `[1/s²]`.
pub(crate) fn bound(
    skins: &Skins,
    (geometry, packs, assembly): (&Geometry, &Packs, &Assembly),
) -> [f64; 2] {
    let mut most = [0.0_f64; 2];
    for body in 0..geometry.bodies.len() {
        let lattice = geometry.lattice(body);
        if lattice.rigid {
            let (pack, lane) = packs.slot(body);
            let matter = &assembly.rigid[packs.packs[pack].rigid_start][lane];
            most[1] = most[1].max(2.0 * rigid(skins, body as u32, matter));
        } else {
            most[0] = most[0].max(deformable(skins, geometry, body));
        }
    }
    most
}

/// Stiffness of contacts on a face of a block for each unit of area, where no joint is, twice for the
/// other block `[Pa/m]`: along the normal and across.
pub(crate) fn outer(skins: &Skins, body: usize, face: FaceOf) -> [f64; 2] {
    let Stiffness { normal, shear } = skins.beyond_joint(body as u32, face);
    [2.0 * normal, 2.0 * shear]
}

pub(crate) fn faces() -> impl Iterator<Item = FaceOf> {
    (0..6).map(FaceOf::of_number)
}

/// Rate of the dashpots of a deformable block's joints or contacts, for a damping ratio of 1: `ω_c √(m/m_n)` with the
/// mass m that vibrates on them and that of the nodes `[1/s]`.
pub(crate) fn dashpot_rate(skins: &Skins, geometry: &Geometry, body: usize) -> f64 {
    let rate = |face: FaceOf| {
        let Stiffness { normal, .. } = skins.stiffest(body as u32, face);
        let moved = skins.moved(body as u32, face, normal);
        normal * per_mass(skins, geometry, (body, face)) * moved
    };
    faces().map(rate).fold(0.0, f64::max).sqrt()
}

/// Area over mass of a node on a face, twice for the other block, `A/m = 2/(ρ h)` `[m²/kg]`.
fn per_mass(skins: &Skins, geometry: &Geometry, (body, face): (usize, FaceOf)) -> f64 {
    let (lattice, d) = (geometry.lattice(body), face.direction);
    let cell = geometry.bodies[body].cell[d] as usize;
    let height = lattice.spacing(d, cell) * lattice.normal(d).dot(&lattice.axes[d]);
    4.0 / (skins.density(body as u32, face) * height)
}

/// A node on a face has an area and half the mass of the elements below it, and on an edge or at a
/// corner the shear of the faces beside adds to it.
fn deformable(skins: &Skins, geometry: &Geometry, body: usize) -> f64 {
    let mut stiffest = [[0.0_f64; 2]; 3];
    for face in faces() {
        let d = face.direction;
        let Stiffness { normal, shear } = skins.beyond_joint(body as u32, face);
        let per_mass = per_mass(skins, geometry, (body, face));
        stiffest[d][0] = stiffest[d][0].max(normal * per_mass);
        stiffest[d][1] = stiffest[d][1].max(shear * per_mass);
    }
    let along = |d: usize| stiffest[d][0] + stiffest[(d + 1) % 3][1] + stiffest[(d + 2) % 3][1];
    along(0).max(along(1)).max(along(2))
}

/// All faces in contact, or in their joint where that is stiffer, at their corners.
fn rigid(skins: &Skins, body: u32, matter: &Matter) -> f64 {
    let mut sum = Matrix6::zeros();
    let mass = matter.mass.sqrt();
    let root = matter.inverse_root();
    for face in faces() {
        let (d, e, f) = (face.direction, (face.direction + 1) % 3, (face.direction + 2) % 3);
        let cross = matter.half[e].cross(&matter.half[f]);
        let normal = cross.try_normalize(0.0).unwrap_or_default();
        let Stiffness { normal: stiff, shear } = skins.stiffest(body, face);
        let across = normal * normal.transpose();
        let k = (Matrix3::identity() * shear + across * (stiff - shear)) * cross.norm();
        let side = matter.half[d] * if face.upper { 1.0 } else { -1.0 };
        for (i, j) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let arm: Vec3 = side + matter.half[e] * i + matter.half[f] * j;
            let mut way = nalgebra::Matrix3x6::zeros();
            way.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() / mass));
            way.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-arm.cross_matrix() * root));
            sum += way.transpose() * k * way;
        }
    }
    sum.symmetric_eigenvalues().max()
}
