//! `where`: planes in gaps, ranges, spheres and sets.

use ddem_deck::{BlockSet, Charge, Extent, Remove, Sphere, Where};

use crate::decks::*;

fn range(axis: usize, from: f64, to: f64) -> Where {
    let mut region = plane(axis, 0.0);
    *[&mut region.x, &mut region.y, &mut region.z][axis] = Some(Extent::Range([from, to]));
    region
}

#[test]
fn plane_in_gap_selects_both_sides() {
    let model = model(&deck([2, 2, 1], [4.0, 2.0, 1.0], 2, 0.02));
    // 3 × 3 nodes of a face, two blocks along y, both sides.
    for x in [1.995, 2.0, 2.005] {
        let nodes = plane(0, x).nodes(&model).unwrap();
        assert_eq!(nodes.len(), 2 * 2 * 9, "x = {x}");
        let on = |x: f64| {
            nodes.iter().filter(|&&n| (model.point(n as usize)[0] - x).abs() < 1e-9).count()
        };
        assert_eq!([on(1.99), on(2.01)], [18, 18]);
    }
    // Each side of the gap is a separate plane.
    assert_eq!(plane(0, 1.99).nodes(&model).unwrap().len(), 18);
    assert_eq!(plane(0, 2.01).nodes(&model).unwrap().len(), 18);
    // At the crossing of two gaps, the nodes of all four blocks.
    let crossing = Where { y: Some(Extent::Plane(1.0)), ..plane(0, 2.0) };
    assert_eq!(crossing.nodes(&model).unwrap().len(), 4 * 3);
    assert!(plane(0, 1.5).nodes(&model).unwrap().is_empty());
    assert_eq!(plane(0, 4.0).nodes(&model).unwrap().len(), 18);
}

#[test]
fn selected_nodes_equal_brute_force_search() {
    let model = model(&with_axes(deck([3, 2, 2], [3.0, 2.0, 2.0], 2, 0.05), OBLIQUE));
    let ball = Sphere { centre: [1.5, 1.0, 1.0], radius: 0.9 };
    let regions = [
        Where::default(),
        range(0, 0.3, 1.7),
        range(2, -10.0, 0.5),
        Where { sphere: Some(ball), ..Where::default() },
        Where { sphere: Some(ball), ..range(1, 0.9, 5.0) },
    ];
    for region in &regions {
        let has = |node: &u32| {
            let x = Vec3::from(model.point(*node as usize));
            let inside = |axis: usize, extent: Option<Extent>| match extent {
                Some(Extent::Range([from, to])) => from <= x[axis] && x[axis] <= to,
                _ => true,
            };
            inside(0, region.x)
                && inside(1, region.y)
                && inside(2, region.z)
                && region.sphere.is_none_or(|s| (x - Vec3::from(s.centre)).norm() <= s.radius)
        };
        let expected: Vec<u32> = (0..model.n_nodes() as u32).filter(has).collect();
        assert!(!expected.is_empty());
        assert_eq!(region.nodes(&model).unwrap(), expected, "{region:?}");
    }
}

#[test]
fn ranges_include_their_ends() {
    let model = model(&deck([2, 1, 1], [2.0, 1.0, 1.0], 2, 0.02));
    // Node planes along x: 0, 0.495, 0.99, 1.01, 1.505, 2.
    assert_eq!(range(0, 0.495, 1.01).nodes(&model).unwrap().len(), 3 * 9);
    assert_eq!(range(0, 0.0, 2.0).nodes(&model).unwrap().len(), model.n_nodes());
    assert!(range(0, 0.5, 0.98).nodes(&model).unwrap().is_empty());
    assert!(range(0, 1.0, 1.0).nodes(&model).unwrap().is_empty());
}

#[test]
fn set_selects_its_own_blocks() {
    let mut deck = deck([1; 3], [1.0; 3], 2, 0.0);
    deck.joints.clear();
    deck.blocks[0].joint = None;
    deck.blocks[0].name = Some("a".into());
    let b = BlockSet {
        name: Some("b".into()),
        origin: [1.0, 0.0, 0.0],
        divisions: 3,
        ..deck.blocks[0].clone()
    };
    deck.blocks.push(b);
    let model = model(&deck);
    let set = |name: &str| Where { set: Some(name.into()), ..Where::default() };
    assert_eq!(set("a").nodes(&model).unwrap(), (0..27).collect::<Vec<u32>>());
    assert_eq!(set("b").nodes(&model).unwrap(), (27..27 + 64).collect::<Vec<u32>>());
    // The sets touch but are not joined: a plane contains the faces of both.
    assert_eq!(plane(0, 1.0).nodes(&model).unwrap().len(), 9 + 16);
    assert_eq!((Where { x: plane(0, 1.0).x, ..set("b") }).nodes(&model).unwrap().len(), 16);
    assert_eq!(crate::decks::warnings(&deck), [""; 0]);
}

#[test]
fn nearest_node_is_lowest_on_tie() {
    let model = model(&deck([2, 1, 1], [2.0, 1.0, 1.0], 1, 0.02));
    assert_eq!(model.point(model.nearest_node([-5.0, -5.0, -5.0])), [0.0; 3]);
    // Block 0 has the nodes 0…7; the point lies in the middle of the gap.
    assert_eq!(model.nearest_node([1.0, 0.0, 0.0]), 1);
    assert_eq!(model.nearest_node([1.001, 0.0, 0.0]), 8);
}

/// The nearest node equals that of a search over all nodes, for two oblique sets with a hole. Among
/// equally near nodes it belongs to a block that remains, and has the lowest number.
#[test]
fn nearest_node_equals_brute_force_search() {
    let mut deck = deck([3, 4, 2], [3.0, 2.0, 1.0], 2, 0.02);
    deck.blocks[0].axes = [[1.0, 0.2, 0.0], [-0.4, 1.0, 0.1], [0.1, 0.0, 1.0]];
    deck.blocks.push(BlockSet { origin: [6.0, -1.0, 0.4], ..deck.blocks[0].clone() });
    deck.stage = vec![relax_stage("before"), relax_stage("dig")];
    let ball = Sphere { centre: [1.5, 1.0, 0.5], radius: 0.8 };
    deck.remove.push(Remove {
        r#where: Where { sphere: Some(ball), ..Where::default() },
        from: Some("dig".into()),
        ..Remove::default()
    });
    deck.fix.push(fix(Where::default(), "xyz"));
    let model = model(&deck);
    let tie = 1e-12 * 10.0;
    let by_all = |at: [f64; 3]| {
        let x = |node: usize| Vec3::from(model.point(node));
        let distance = |node: &usize| (x(*node) - Vec3::from(at)).norm();
        let least = (0..model.n_nodes()).map(|node| distance(&node)).fold(f64::INFINITY, f64::min);
        let near = (0..model.n_nodes()).filter(|node| distance(node) <= least + tie);
        let stays = |node: &usize| model.removed_in(model.block_of(*node)).unwrap_or(usize::MAX);
        near.min_by_key(|node| (std::cmp::Reverse(stays(node)), *node))
    };
    // Points spread over a box larger than both sets, midway between two nodes, and far away.
    let spread = |k: u32| {
        let [x, y, z] = [0.618_034, 0.414_214, 0.732_051].map(|part| (f64::from(k) * part).fract());
        [14.0 * x - 2.0, 8.0 * y - 3.0, 4.0 * z - 1.0]
    };
    let between = |node: usize| {
        let [a, b] = [node, (node + 7) % model.n_nodes()].map(|node| Vec3::from(model.point(node)));
        ((a + b) / 2.0).into()
    };
    let places = (0..200).map(spread).chain((0..model.n_nodes()).step_by(7).map(between));
    for at in places.chain([[1e6, 0.0, 0.0], [-1e6, 1e6, 1e6]]) {
        assert_eq!(Some(model.nearest_node(at)), by_all(at), "{at:?}");
    }
}

/// The element at a point belongs to the block that contains the point, whichever node is nearest.
#[test]
fn point_selects_element_of_containing_block() {
    let mut deck = deck([1; 3], [1.0; 3], 2, 0.0);
    deck.joints.clear();
    deck.blocks[0].joint = None;
    deck.blocks.push(BlockSet { origin: [1.0, 0.3, 0.0], divisions: 3, ..deck.blocks[0].clone() });
    let model = model(&deck);
    // Here the node of the first block is nearer and has the lower number.
    assert_eq!(model.block_of(model.nearest_node([1.01, 0.99, 0.5])), 0);
    assert_eq!(model.element_at([1.01, 0.99, 0.6]), (1, [0, 2, 1]));
    assert_eq!(model.element_at([0.99, 0.6, 0.6]), (0, [1, 1, 1]));
    // On a face it is the element with the lower index.
    assert_eq!(model.element_at([1.0, 0.6, 0.6]), (0, [1, 1, 1]));
    assert_eq!(model.element_at([0.5, 0.5, 0.5]), (0, [0, 0, 0]));
    // Outside of all blocks it is the nearest element.
    assert_eq!(model.element_at([-3.0, 0.9, 0.9]), (0, [0, 1, 1]));
    assert_eq!(model.element_at([5.0, 1.2, 0.9]), (1, [2, 2, 2]));
}

/// The error of an empty selection names the nearest item and its place.
#[test]
fn empty_selection_names_nearest_item() {
    let mut deck = deck([2, 1, 1], [2.0, 1.0, 1.0], 1, 0.0);
    deck.blocks[0].body = ddem_deck::Body::Rigid;
    let seam = deck.joints.values_mut().next();
    let seam = seam.unwrap_or_else(|| panic!("a joint"));
    (seam.normal_stiffness, seam.shear_stiffness) = (Some(1e9), Some(1e9));
    seam.material = None;
    let mut help = |region: Where| {
        deck.fix = vec![fix(region, "xyz")];
        let error = deck.build().err().unwrap_or_else(|| panic!("nothing is wrong"));
        assert_eq!(error.faults[0].place, "fix[0].where");
        error.faults[0].help.clone().unwrap_or_default()
    };
    // The range contains a corner, but no centroid.
    let corner = help(range(0, 1.7, 2.3));
    assert!(
        corner.ends_with(
            "block 1, has it at [1.5000, 0.5000, 0.5000] and a corner at [1.0000, 0.0000, 0.0000]"
        ),
        "{corner}"
    );
    deck.blocks[0].body = ddem_deck::Body::Deformable;
    let mut help = |region: Where| {
        deck.fix = vec![fix(region, "xyz")];
        let error = deck.build().err().unwrap_or_else(|| panic!("nothing is wrong"));
        error.faults[0].help.clone().unwrap_or_default()
    };
    let node = help(range(0, 2.2, 2.3));
    assert!(node.ends_with("the nearest node is at [2.0000, 0.0000, 0.0000]"), "{node}");
}

#[test]
fn charge_joints_equal_brute_force_search() {
    let ball = |centre: [f64; 3], radius: f64| Where {
        sphere: Some(Sphere { centre, radius }),
        ..Where::default()
    };
    let regions = [
        ball([1.5, 1.0, 1.0], 0.9),
        ball([3.2, 2.1, 0.4], 1.3),
        Where { x: Some(Extent::Range([0.9, 2.2])), ..ball([2.0, 1.5, 1.0], 1.1) },
        range(2, 0.8, 1.3),
        range(0, -10.0, 10.0),
    ];
    let mut deck = with_axes(deck([20, 16, 12], [5.0, 4.0, 3.0], 1, 0.01), OBLIQUE);
    let charge = |region: &Where| Charge {
        r#where: region.clone(),
        pressure: Some(1e6),
        ..Charge::default()
    };
    deck.charge = regions.iter().map(charge).collect();
    let model = model(&deck);
    let centre = |face: &ddem_core::ConformingJoint| {
        let pairs: Vec<_> = face.pairs(model.geometry()).flatten().collect();
        let sum = |k: usize| pairs.iter().map(|&n| model.point(n as usize)[k]).sum::<f64>();
        [0, 1, 2].map(|k| sum(k) / pairs.len() as f64)
    };
    let centres: Vec<[f64; 3]> = model.faces().iter().map(centre).collect();
    let inside = |region: &Where, x: &[f64; 3]| {
        let ranges = [region.x, region.y, region.z].into_iter().zip(x).all(|(extent, &x)| {
            let Some(Extent::Range([from, to])) = extent else { return true };
            from <= x && x <= to
        });
        ranges
            && region.sphere.is_none_or(|ball| {
                let off = [0, 1, 2].map(|k| (x[k] - ball.centre[k]).powi(2));
                off.iter().sum::<f64>().sqrt() <= ball.radius
            })
    };
    let count = |region: &Where| centres.iter().filter(|x| inside(region, x)).count();
    let joints: Vec<usize> = model.charges().iter().map(|size| size.joints).collect();
    assert_eq!(joints, regions.iter().map(count).collect::<Vec<_>>());
    assert!(joints.iter().all(|&joints| joints > 0) && joints[0] < joints[4], "{joints:?}");
}
