//! Shapes of cuts, from their keys.

use ddem_core::problem::Vec3;
use ddem_cut::{
    Compass, CutPlane, DiscCount, DiscSize, Fracture, FractureNetwork, JointSet, Outline, Spacing,
    Tunnel, voronoi_seeds,
};

use crate::schema::{
    DiscSizes, NetworkCut, PlaneCut, RockCut, SetCut, SetSpacing, SpacingLaw, SurfaceFile,
    TunnelCut, VoronoiCut,
};

pub(super) fn joint_set(set: &SetCut, compass: &Compass, middle: Vec3) -> JointSet {
    JointSet {
        normal: compass.normal(set.dip, set.dip_direction),
        fisher: set.fisher,
        spacing: spacing(&set.spacing),
        origin: set.origin.map_or(middle, Vec3::from),
    }
}

pub(super) fn spacing(spacing: &SetSpacing) -> Spacing {
    match *spacing {
        SetSpacing::Constant(distance) => Spacing::Constant(distance),
        SetSpacing::Random(table) => {
            let (mean, least) = (table.mean, table.least.unwrap_or_default());
            match table.law {
                None => Spacing::Even { mean, spread: table.spread.unwrap_or_default() },
                Some(SpacingLaw::Exponential) => Spacing::Exponential { mean, least },
                Some(SpacingLaw::Lognormal) => {
                    let deviation = table.deviation.unwrap_or(mean);
                    Spacing::Lognormal { mean, deviation, least }
                }
            }
        }
    }
}

pub(super) fn plane(
    plane: &PlaneCut,
    compass: &Compass,
    cut: u32,
    joined: bool,
) -> Option<CutPlane> {
    match plane.points {
        Some(points) => CutPlane::through(points.map(Vec3::from), cut, joined),
        None => {
            let normal = compass.normal(plane.dip?, plane.dip_direction?);
            CutPlane::new(normal, plane.through?.into(), cut, joined)
        }
    }
}

pub(super) fn tunnel(
    tunnel: &TunnelCut,
    compass: &Compass,
    cut: u32,
    joined: bool,
) -> Option<Tunnel> {
    let outline = Outline::new(&tunnel.outline).ok()?;
    let ends = [tunnel.from, tunnel.to].map(Vec3::from);
    Tunnel::new(&outline, ends, compass, cut, joined).ok()
}

/// Fractures of a cut of finite size in a box; `None` for other cuts.
pub(super) fn fractures(
    entry: &RockCut,
    number: u32,
    compass: &Compass,
    seed: u64,
    bounds: [Vec3; 2],
) -> Option<Vec<Fracture>> {
    let joined = entry.join;
    if let Some(disc) = &entry.disc {
        let normal = compass.normal(disc.dip, disc.dip_direction);
        return Some(vec![Fracture::disc(
            disc.centre.into(),
            normal,
            disc.radius,
            number,
            joined,
        )?]);
    }
    if let Some(corners) = &entry.polygon {
        let corners: Vec<Vec3> = corners.iter().map(|corner| Vec3::from(*corner)).collect();
        return Some(vec![Fracture::polygon(&corners, number, joined).ok()?]);
    }
    if let Some(file) = &entry.surface {
        let triangles = file.content.iter().filter_map(|content| match &**content {
            SurfaceFile::Triangles(triangles) => Some(&triangles.0),
            SurfaceFile::Heights(_) => None,
        });
        let triangles = triangles.flatten();
        let triangles = triangles.map(|corners| corners.map(Vec3::from));
        // Triangles without area have no plane.
        return Some(
            triangles
                .filter_map(|corners| Fracture::polygon(&corners, number, joined).ok())
                .collect(),
        );
    }
    let of = entry.dfn.as_ref()?;
    let mut all = match &of.file {
        Some(file) => {
            let rows = file.content.iter().flat_map(|content| &content.0);
            let disc = |&[x, y, z, dip, direction, radius]: &[f64; 6]| {
                Fracture::disc(
                    Vec3::new(x, y, z),
                    compass.normal(dip, direction),
                    radius,
                    number,
                    joined,
                )
            };
            rows.filter_map(disc).collect()
        }
        None => network(of, compass)?.fractures(bounds, seed, number, joined),
    };
    let least = of.least.unwrap_or_default();
    all.retain(|fracture| fracture.radius >= least);
    Some(all)
}

/// Seeds of Voronoi cells in a box.
pub(super) fn seeds(of: &VoronoiCut, number: u32, seed: u64, bounds: [Vec3; 2]) -> Vec<Vec3> {
    match (&of.points, of.number) {
        (Some(points), _) => points.iter().map(|point| Vec3::from(*point)).collect(),
        (None, wanted) => {
            let (wanted, least) = (wanted.unwrap_or_default(), of.least.unwrap_or_default());
            voronoi_seeds(bounds, wanted as usize, least, seed, number)
        }
    }
}

/// Statistics of a network; `None` if it is in a file.
pub(super) fn network(of: &NetworkCut, compass: &Compass) -> Option<FractureNetwork> {
    let count = match (of.p32, of.number) {
        (Some(intensity), _) => DiscCount::Intensity(intensity),
        (None, number) => DiscCount::Number(number? as usize),
    };
    let size = match of.size? {
        DiscSizes::Constant(radius) => DiscSize::Constant(radius),
        DiscSizes::Power(law) => {
            DiscSize::Power { exponent: law.power, from: law.from, to: law.to }
        }
    };
    let normal = compass.normal(of.dip?, of.dip_direction?);
    Some(FractureNetwork { count, size, normal, fisher: of.fisher })
}
