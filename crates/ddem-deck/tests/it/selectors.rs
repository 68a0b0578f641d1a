//! `where` in field terms: planes of any orientation, dip and dip direction, half-spaces, closed
//! surfaces, topographies and sides of sets; and the report on curved and slanted regions.

use std::sync::Arc;

use ddem_core::{Model, Simulation};
use ddem_deck::Selection;
use ddem_deck::*;
use nalgebra::{Rotation3, Unit};

use crate::decks::*;

fn slanted(point: Vec3, normal: Vec3) -> Plane {
    Plane { point: point.into(), normal: Some((normal * 3.0).into()), ..Plane::default() }
}

fn dipping(point: [f64; 3], dip: f64, dip_direction: f64) -> Plane {
    let (dip, dip_direction) = (Some(dip), Some(dip_direction));
    Plane { point, dip, dip_direction, ..Plane::default() }
}

fn on(plane: Plane) -> Where {
    Where { plane: Some(plane), ..Where::default() }
}

fn above(sheet: Sheet) -> Where {
    Where { above: Some(sheet), ..Where::default() }
}

fn below(sheet: Sheet) -> Where {
    Where { below: Some(sheet), ..Where::default() }
}

fn side(side: Side) -> Where {
    Where { side: Some(side), ..Where::default() }
}

fn remove(mut deck: Deck, region: Where) -> Deck {
    deck.remove.push(Remove { r#where: region, ..Remove::default() });
    deck
}

/// The whole deck rotated, and the rotation.
fn turned(mut deck: Deck) -> (Deck, Rotation3<f64>) {
    let turn = Rotation3::from_axis_angle(&Unit::new_normalize(Vec3::new(1.0, -2.0, 0.5)), 0.7);
    deck.blocks[0].axes = BOX.map(|axis| (turn * Vec3::from(axis)).into());
    (deck, turn)
}

#[test]
fn plane_normal_to_axis_equals_axis_plane() {
    let model = model(&deck([2, 2, 2], [4.0, 2.0, 2.0], 2, 0.02));
    for at in [0.0, 2.0, 1.99, 4.0] {
        let nodes = plane(0, at).nodes(&model).unwrap();
        assert!(!nodes.is_empty());
        for normal in [Vec3::x(), -Vec3::x()] {
            assert_eq!(on(slanted(Vec3::new(at, 7.0, 8.0), normal)).nodes(&model).unwrap(), nodes);
        }
        assert_eq!(on(dipping([at, 1.0, 2.0], 90.0, 90.0)).nodes(&model).unwrap(), nodes);
        assert_eq!(on(dipping([at, 1.0, 2.0], 90.0, 270.0)).nodes(&model).unwrap(), nodes);
    }
    let level = Plane { point: [0.0, 0.0, 2.0], dip: Some(0.0), ..Plane::default() };
    assert_eq!(on(level).nodes(&model).unwrap(), plane(2, 2.0).nodes(&model).unwrap());
}

/// Rotated planes select the nodes that axis planes select in the upright model, gaps included.
#[test]
fn rotated_planes_select_same_nodes() {
    let upright = deck([3, 2, 2], [3.0, 2.0, 2.0], 2, 0.02);
    let (turned, turn) = turned(upright.clone());
    let (upright, turned) = (model(&upright), model(&turned));
    for (axis, at) in [(0, 0.0), (0, 1.0), (0, 0.99), (1, 1.0), (2, 2.0)] {
        let nodes = plane(axis, at).nodes(&upright).unwrap();
        assert!(!nodes.is_empty());
        let normal = turn * Vec3::ith(axis, 1.0);
        assert_eq!(on(slanted(normal * at, normal)).nodes(&turned).unwrap(), nodes, "{axis} {at}");
    }
    let sides = [Side::LowX, Side::HighX, Side::LowY, Side::HighY, Side::LowZ, Side::HighZ];
    for (k, end) in sides.into_iter().enumerate() {
        let at = if k % 2 == 0 { 0.0 } else { [3.0, 2.0, 2.0][k / 2] };
        let nodes = plane(k / 2, at).nodes(&upright).unwrap();
        assert_eq!(side(end).nodes(&upright).unwrap(), nodes);
        assert_eq!(side(end).nodes(&turned).unwrap(), nodes);
    }
}

/// Reaction of a rotated set that is fixed on one side, with a pressure on the opposite side.
fn reaction(mut deck: Deck, [held, pressed]: [Where; 2]) -> Vec3 {
    deck.fix.push(fix(held.clone(), "xyz"));
    deck.load.push(Load { r#where: pressed, pressure: Some(2e5), ..Load::default() });
    deck.stage.push(relax_stage("press"));
    let mut simulation = Simulation::new(model(&deck));
    simulation.relax(1e-9, 200_000).unwrap_or_else(|error| panic!("{error}"));
    let nodes = held.nodes(simulation.model()).unwrap();
    Vec3::from(simulation.reaction(&nodes))
}

/// Pressure times area, along the normal.
#[test]
fn rotated_face_carries_pressure_times_area() {
    let (deck, turn) = turned(deck([2, 3, 2], [2.0, 3.0, 2.0], 2, 0.02));
    let (up, top) = (turn * Vec3::z(), turn * Vec3::new(1.0, 1.5, 2.0));
    let exact = up * (2e5 * 6.0);
    let by_side = [side(Side::LowZ), side(Side::HighZ)];
    let by_plane = [on(slanted(Vec3::zeros(), up)), on(slanted(top, up))];
    for regions in [by_side, by_plane] {
        let found = reaction(deck.clone(), regions);
        assert!((found - exact).norm() < 1e-6 * exact.norm(), "{found} {exact}");
    }
}

#[test]
fn half_spaces_equal_ranges_along_axis() {
    let model = model(&deck([3, 2, 2], [3.0, 2.0, 2.0], 2, 0.02));
    let range = |from, to| Where { z: Some(Extent::Range([from, to])), ..Where::default() };
    let same = |region: Where, other: Where| {
        let nodes = region.nodes(&model).unwrap();
        assert!(!nodes.is_empty() && nodes.len() < model.n_nodes());
        assert_eq!(nodes, other.nodes(&model).unwrap());
    };
    same(above(Sheet::Level(1.2)), range(1.2, 9.0));
    same(below(Sheet::Level(1.2)), range(-9.0, 1.2));
    let both = Where { below: Some(Sheet::Level(1.6)), ..above(Sheet::Level(0.3)) };
    same(both, range(0.3, 1.6));
    // `above` is the higher side for either direction of the normal.
    for up in [1.0, -1.0] {
        let plane = Sheet::Plane(slanted(Vec3::new(5.0, 5.0, 1.2), Vec3::z() * up));
        same(above(plane), range(1.2, 9.0));
    }
    // For an upright plane it is the side to which the normal points.
    let east = Sheet::Plane(dipping([1.2, 0.0, 0.0], 90.0, 90.0));
    same(above(east), Where { x: Some(Extent::Range([1.2, 9.0])), ..Where::default() });
}

/// A slope of 45° towards the east; blocks are selected by their centroids.
#[test]
fn half_space_selects_blocks_above_slope() {
    let cube = deck([4, 4, 4], [4.0; 3], 1, 0.01);
    let slope = |z: f64| Sheet::Plane(dipping([0.0, 0.0, z], 45.0, 90.0));
    let count = |region: Where| 64 - model(&remove(cube.clone(), region)).n_blocks();
    // x + z ≥ 4.1 with centroids at halves: 6 of 16 in each row along y.
    assert_eq!(count(above(slope(4.1))), 24);
    assert_eq!(count(below(slope(4.1))), 40);
    // Centroids on the plane belong to both sides.
    assert_eq!(count(above(slope(4.0))), 40);
    assert_eq!(count(below(slope(4.0))), 40);

    let reports = crate::decks::built(&remove(cube, above(slope(4.1)))).selections();
    let [Selection { entry, blocks, volume, holds, shape, .. }] = &reports[..] else {
        panic!("{reports:?}")
    };
    assert_eq!((entry.as_str(), *blocks, *shape), ("remove[0]", 24, "half-space"));
    assert!((volume - 24.0).abs() < 1e-12);
    // A triangular prism with legs of 3.9 m along y.
    assert!((holds.unwrap_or(0.0) - 0.5 * 3.9 * 3.9 * 4.0).abs() < 1e-9);
}

fn joints_named(model: &Model, name: u16) -> Vec<u8> {
    model.faces().iter().filter(|face| face.joint == name).map(|face| face.direction).collect()
}

/// Bedding and two steep joint sets, each found by its dip and dip direction.
#[test]
fn dip_and_dip_direction_select_joints() {
    let mut bedded = deck([2, 2, 3], [2.0, 2.0, 3.0], 1, 0.01);
    bedded.joints.values_mut().for_each(|joint| joint.thickness = 0.01);
    let bedding = bedded.joints["seam"].clone();
    bedded.joints.insert("bedding".into(), bedding);
    (bedded.blocks[0].dip, bedded.blocks[0].dip_direction) = (Some(30.0), Some(130.0));
    let find = |dip: f64, dip_direction: Option<f64>, within: Option<f64>| {
        let mut deck = bedded.clone();
        let region = Where { dip: Some(dip), dip_direction, within, ..Where::default() };
        deck.assign.push(Assign {
            r#where: region,
            joint: Some("bedding".into()),
            ..Assign::default()
        });
        deck.build().map(|model| joints_named(&model, 0))
    };
    let bedding = vec![2; 8];
    assert_eq!(find(30.0, Some(130.0), None), Ok(bedding.clone()));
    assert_eq!(find(31.5, Some(128.0), None), Ok(bedding.clone()));
    assert_eq!(find(30.0, None, None), Ok(bedding));
    assert_eq!(find(60.0, Some(310.0), None), Ok(vec![0; 6]));
    assert_eq!(find(90.0, Some(220.0), None), Ok(vec![1; 6]));
    // The dip direction of an upright joint may point to either side.
    assert_eq!(find(90.0, Some(40.0), None), Ok(vec![1; 6]));
    assert_eq!(find(33.0, Some(130.0), Some(3.01)).map(|all| all.len()), Ok(8));
    for nothing in [find(33.0, Some(130.0), None), find(30.0, Some(140.0), None)] {
        let message = nothing.map_err(|error| error.to_string()).err().unwrap_or_default();
        assert!(message.contains("assign[0].where: selects nothing: no joint there"), "{message}");
    }
}

/// Directions of the edges: down the dip, along the strike, up along the normal.
#[test]
fn bedding_orients_sets() {
    let far = |dip: f64, dip_direction: f64, at: [f64; 3]| {
        let mut deck = deck([1, 1, 1], [1.0, 2.0, 3.0], 1, 0.01);
        (deck.blocks[0].dip, deck.blocks[0].dip_direction) = (Some(dip), Some(dip_direction));
        let model = model(&deck);
        (0..8)
            .map(|node| (Vec3::from(model.point(node)) - Vec3::from(at)).norm())
            .fold(f64::MAX, f64::min)
    };
    // Dip direction east equals the default. With north the first edge points north.
    assert_eq!(far(0.0, 90.0, [1.0, 2.0, 3.0]), 0.0);
    assert_eq!(far(0.0, 0.0, [-2.0, 1.0, 3.0]), 0.0);
    // Ends of the edges for 30° towards the east.
    let (s, c) = 30_f64.to_radians().sin_cos();
    assert!(far(30.0, 90.0, [c, 0.0, -s]) < 1e-14);
    assert!(far(30.0, 90.0, [0.0, 2.0, 0.0]) < 1e-14);
    assert!(far(30.0, 90.0, [3.0 * s, 0.0, 3.0 * c]) < 1e-14);
}

/// Three oblique joint sets: block faces have these orientations and no others.
#[test]
fn joint_sets_orient_block_faces() {
    let mut oblique = deck([2, 2, 2], [2.0, 2.0, 2.0], 1, 0.01);
    let set = |dip, dip_direction| Orientation { dip, dip_direction };
    let sets = [set(70.0, 95.0), set(80.0, 350.0), set(25.0, 130.0)];
    let [x, y, z] = sets;
    oblique.blocks[0].planes = Some(Orientations { x, y, z });
    let other = oblique.joints["seam"].clone();
    oblique.joints.insert("a".into(), other);
    for (direction, Orientation { dip, dip_direction }) in sets.into_iter().enumerate() {
        let mut deck = oblique.clone();
        let region = Where {
            dip: Some(dip),
            dip_direction: Some(dip_direction),
            within: Some(1e-6),
            ..Where::default()
        };
        deck.assign.push(Assign { r#where: region, joint: Some("a".into()), ..Assign::default() });
        assert_eq!(joints_named(&model(&deck), 0), [direction as u8; 4]);
    }
    let model = model(&oblique);
    let point = |k: usize| Vec3::from(model.point(k));
    let edges = [point(1) - point(0), point(2) - point(0), point(4) - point(0)];
    assert!(edges[0].x > 0.0 && edges[2].z > 0.0);
    assert!(edges[0].dot(&edges[1].cross(&edges[2])) > 0.0);
}

/// Octahedron |x| + |y| + |z| ≤ r about a centre.
fn octahedron(centre: [f64; 3], r: f64) -> Triangles {
    let tip = |k: usize, way: f64| {
        let mut tip = centre;
        tip[k] += way * r;
        tip
    };
    let signs = [-1.0, 1.0];
    let mut all = Vec::new();
    for (a, b, c) in
        signs.iter().flat_map(|&a| signs.iter().flat_map(move |&b| signs.map(|c| (a, b, c))))
    {
        let face = [tip(0, a), tip(1, b), tip(2, c)];
        all.push(if a * b * c > 0.0 { face } else { [face[0], face[2], face[1]] });
    }
    Triangles(all)
}

fn inside(triangles: Triangles) -> Where {
    let file = FileOf { path: "pit.stl".into(), content: Some(Arc::new(triangles)) };
    Where { inside: Some(file), ..Where::default() }
}

#[test]
fn closed_surface_selects_blocks_and_nodes() {
    let cube = deck([6, 6, 6], [6.0; 3], 1, 0.01);
    // Its tips, edges and faces lie above and below centroids, and some pass through centroids.
    for (centre, r) in [([3.0; 3], 2.5), ([3.5, 3.5, 3.5], 2.0), ([2.75, 3.1, 3.2], 2.2)] {
        let size = |x: [f64; 3]| (0..3).map(|k| f64::abs(x[k] - centre[k])).sum::<f64>();
        let halves = || (0..6).map(|i| f64::from(i) + 0.5);
        let all =
            halves().flat_map(|x| halves().flat_map(move |y| halves().map(move |z| [x, y, z])));
        let expected = all.filter(|x| size(*x) <= r + 1e-9).count();
        let site = crate::decks::built(&remove(cube.clone(), inside(octahedron(centre, r))));
        assert_eq!(216 - site.model().n_blocks(), expected, "{centre:?} {r}");
        let reports = site.selections();
        assert_eq!((reports[0].blocks, reports[0].volume), (expected, expected as f64));
        // 4/3 r³
        assert!((reports[0].holds.unwrap_or(0.0) - 4.0 / 3.0 * r.powi(3)).abs() < 1e-9);
        assert!(!reports[0].sticks_out);
    }
    let model = model(&cube);
    let nodes = inside(octahedron([3.0; 3], 2.0)).nodes(&model).unwrap();
    let near = |node: &u32| {
        model.point(*node as usize).iter().map(|x| (x - 3.0).abs()).sum::<f64>() <= 2.0 + 1e-9
    };
    let expected: Vec<u32> = (0..model.n_nodes() as u32).filter(near).collect();
    assert_eq!(nodes, expected);
}

#[test]
fn open_surface_is_refused() {
    let mut open = octahedron([3.0; 3], 2.0);
    open.0.pop();
    let cube = deck([2, 2, 2], [6.0; 3], 1, 0.01);
    refused(
        &remove(cube.clone(), inside(open)),
        &["remove[0].where.inside", "`pit.stl` is not closed: 3 open edges of 7 triangles"],
    );
    refused(&remove(cube.clone(), inside(Triangles::default())), &["has no triangle"]);
    let unread = Where { inside: Some(FileOf::new("pit.stl")), ..Where::default() };
    refused(&remove(cube, unread), &["the file `pit.stl` has not been read"]);
}

fn heights(x: &[f64], y: &[f64], z: &[f64]) -> Sheet {
    let grid = Heights { x: x.into(), y: y.into(), z: z.into(), rim: 0.0 };
    Sheet::Topography {
        topography: FileOf { path: "ground.csv".into(), content: Some(Arc::new(grid.into())) },
    }
}

/// Height 2.1 + x/2 over y = 0 and 2.1 over y = 4, bilinear between.
#[test]
fn topography_selects_blocks_above_and_below() {
    let cube = deck([4, 4, 4], [4.0; 3], 1, 0.01);
    let ground = || heights(&[0.0, 4.0], &[0.0, 4.0], &[2.1, 4.1, 2.1, 2.1]);
    let halves = || (0..4).map(|i| f64::from(i) + 0.5);
    let height = |x: f64, y: f64| 2.1 + 0.5 * x * (1.0 - y / 4.0);
    let all = halves().flat_map(|x| halves().flat_map(move |y| halves().map(move |z| [x, y, z])));
    let over = all.filter(|[x, y, z]| *z >= height(*x, *y)).count();
    assert!(over > 10 && over < 40);
    assert_eq!(64 - model(&remove(cube.clone(), above(ground()))).n_blocks(), over);
    assert_eq!(model(&remove(cube.clone(), below(ground()))).n_blocks(), over);
    let reports = crate::decks::built(&remove(cube, above(ground()))).selections();
    assert_eq!((reports[0].shape, reports[0].blocks, reports[0].holds), ("topography", over, None));
}

#[test]
fn topography_must_cover_selected_points() {
    let cube = deck([4, 4, 4], [4.0; 3], 1, 0.01);
    let short = || heights(&[0.0, 2.0], &[0.0, 4.0], &[2.1; 4]);
    refused(
        &remove(cube.clone(), above(short())),
        &[
            "remove[0].where.above.topography",
            "`ground.csv` does not cover the model: it covers x from 0 to 2 and y from 0 to 4, and the model \
             has [2.5, 0.5, 0.5]",
        ],
    );
    // Other conditions of the `where` may exclude the uncovered part.
    let part = Where { x: Some(Extent::Range([0.0, 2.0])), ..above(short()) };
    assert_eq!(64 - model(&remove(cube.clone(), part)).n_blocks(), 16);
    let holed = heights(&[0.0, 2.0, 4.0], &[0.0, 4.0], &[2.1, 2.1, f64::NAN, 2.1, 2.1, 2.1]);
    refused(&remove(cube.clone(), above(holed)), &["has no height at [2.5, 0.5, 0.5]"]);
    // Nodes extend farther than centroids.
    let centres = || heights(&[0.5, 3.5], &[0.5, 3.5], &[2.1; 4]);
    assert_eq!(64 - model(&remove(cube.clone(), above(centres()))).n_blocks(), 32);
    let mut held = cube;
    held.fix.push(fix(above(centres()), "xyz"));
    refused(&held, &["fix[0].where.above.topography", "[0, 0, 0]"]);
}

/// Blocks, nodes and faces of a side; with several sets the deck must name one.
#[test]
fn side_selects_blocks_nodes_and_faces() {
    let mut two = deck([3, 2, 2], [3.0, 2.0, 2.0], 2, 0.02);
    two.blocks[0].name = Some("a".into());
    let b = BlockSet { name: Some("b".into()), origin: [10.0, 0.0, 0.0], ..two.blocks[0].clone() };
    two.blocks.push(b);
    let of = |name: &str| Where { set: Some(name.into()), ..side(Side::HighX) };
    assert_eq!(24 - model(&remove(two.clone(), of("b"))).n_blocks(), 4);
    let model = model(&two);
    let at = |x| Where { x: Some(Extent::Plane(x)), ..Where::default() };
    assert_eq!(of("a").nodes(&model).unwrap(), at(3.0).nodes(&model).unwrap());
    assert_eq!(of("b").nodes(&model).unwrap(), at(13.0).nodes(&model).unwrap());
    refused(
        &remove(two, side(Side::HighX)),
        &["remove[0].where.side", "`side` needs `set`: the model has 2 sets", "set = …"],
    );
}

#[test]
fn invalid_orientations_are_refused() {
    let cube = || deck([2, 2, 2], [2.0; 3], 1, 0.01);
    let fixed = |plane: Plane, words: &[&str]| {
        let mut deck = cube();
        deck.fix.push(fix(on(plane), "xyz"));
        refused(&deck, words);
    };
    fixed(slanted(Vec3::zeros(), Vec3::zeros()), &["fix[0].where.plane.normal", "has length 0"]);
    fixed(dipping([0.0; 3], 95.0, 0.0), &["fix[0].where.plane.dip", "95 but must be from 0 to 90"]);
    fixed(dipping([0.0; 3], 45.0, 400.0), &["plane.dip_direction", "from 0 to 360"]);
    fixed(Plane::default(), &["fix[0].where.plane: the plane has no orientation"]);
    let half = Plane { dip: Some(45.0), ..Plane::default() };
    fixed(half, &["fix[0].where.plane.dip", "`dip` needs `dip_direction`"]);
    let twice = Plane { normal: Some([0.0, 0.0, 1.0]), ..dipping([0.0; 3], 45.0, 0.0) };
    fixed(twice, &["`dip` cannot be combined with `normal`"]);

    let steep = Where { dip: Some(60.0), ..Where::default() };
    refused(&remove(cube(), steep), &["remove[0].where.dip", "here blocks are selected"]);
    let mut deck = cube();
    let region = Where { dip_direction: Some(60.0), ..Where::default() };
    deck.assign.push(Assign { r#where: region, joint: Some("seam".into()), ..Assign::default() });
    refused(&deck, &["assign[0].where.dip_direction", "`dip_direction` needs `dip`"]);

    let mut deck = cube();
    (deck.blocks[0].dip, deck.blocks[0].axes) = (Some(30.0), LEANING);
    refused(
        &deck,
        &["blocks[0].dip", "`dip` cannot be combined with `axes`", "needs `dip_direction`"],
    );
    let mut deck = cube();
    let upright = |dip_direction| Orientation { dip: 90.0, dip_direction };
    let [x, y, z] = [0.0, 50.0, 100.0].map(upright);
    deck.blocks[0].planes = Some(Orientations { x, y, z });
    refused(&deck, &["blocks[0].planes", "have a direction in common"]);
}

/// Number of blocks that a tunnel removes, with the volume of the cylinder in the model.
#[test]
fn curved_excavation_reports_block_count_and_volume() {
    let mut rock = deck([10, 5, 10], [10.0; 3], 1, 0.01);
    let cylinder = Cylinder { from: [5.0, -3.0, 5.0], to: [5.0, 20.0, 5.0], radius: 3.5 };
    let region = Where { cylinder: Some(cylinder), ..Where::default() };
    rock.remove.push(Remove { r#where: region, from: Some("tunnel".into()), ..Remove::default() });
    let ball =
        Where { sphere: Some(Sphere { centre: [0.0, 5.0, 5.0], radius: 1.2 }), ..Where::default() };
    rock.refine.push(Refine { r#where: ball, factor: 2 });
    rock.fix.push(fix(plane(2, 0.0), "xyz"));
    rock.stage.extend([relax_stage("weight"), relax_stage("tunnel")]);
    let reports: Vec<String> =
        crate::decks::built(&rock).selections().iter().map(ToString::to_string).collect();
    // π 3.5² 10 = 384.8 of the 23 m long cylinder, 4/3 π 1.2³ = 7.238.
    assert_eq!(
        reports,
        [
            "refine 0: 2 blocks, 4 m³ (the sphere holds 7.238 m³, in part outside of the blocks)",
            "excavate `tunnel`: 160 blocks, 320 m³ (the cylinder holds 384.8 m³)",
        ]
    );
    // Ranges along the axes of blocks need no report; on rotated blocks they are reported.
    let range = Where { x: Some(Extent::Range([0.0, 2.0])), ..Where::default() };
    let cube = deck([4, 4, 4], [4.0; 3], 1, 0.01);
    assert!(crate::decks::built(&remove(cube.clone(), range.clone())).selections().is_empty());
    let reports = crate::decks::built(&remove(turned(cube).0, range)).selections();
    assert_eq!(reports[0].shape, "box");
}
