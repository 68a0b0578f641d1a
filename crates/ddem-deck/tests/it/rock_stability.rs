//! Block theory on decks: wedges in closed form, excavations, supports and joints without a strength.

use ddem_deck::{BlockMode, BlockVerdict};

use crate::rock_decks::cut;

/// Wedge of two joints behind a slope that is dug, 10 m high.
const SLOPE: &str = "
[model]
gravity = [0, 0, -9.81]
[materials.granite]
density = 2600.0
young = 50e9
poisson = 0.25
[joints.one]
normal_stiffness = 20e9
shear_stiffness = 8e9
friction = 30.0
cohesion = 20e3
[joints.other]
normal_stiffness = 20e9
shear_stiffness = 8e9
friction = 30.0
cohesion = 20e3
[[region]]
box = { from = [-150, -150, -20], to = [150, 150, 10] }
material = 'granite'
[[cut]]
name = 'left'
plane = { dip = 40, dip_direction = 130, through = [0, 0, 0] }
joint = 'one'
[[cut]]
name = 'right'
plane = { dip = 60, dip_direction = 220, through = [0, 0, 0] }
joint = 'other'
[[cut]]
name = 'face'
plane = { dip = 70, dip_direction = 156, through = [0, 0, 0] }
join = true
[[remove]]
where = { above = { point = [0, 0, 0], dip = 70, dip_direction = 156 } }
from = 'dig'
[[stage]]
name = 'rest'
kind = 'relax'
[[stage]]
name = 'dig'
kind = 'relax'
";

/// Verdict on the cell that contains a point.
fn at(text: &str, point: [f64; 3]) -> BlockVerdict {
    let rock = cut(text);
    let inside = |&cell: &usize| {
        rock.complex.cells()[cell].faces.iter().all(|face| {
            let off = ddem_core::problem::Vec3::from(point) - rock.complex.middle(face);
            rock.complex.outward(face).dot(&off) <= 0.0
        })
    };
    let cell = (0..rock.properties.len()).find(inside).unwrap();
    rock.verdicts()[cell].clone()
}

/// Point of the wedge: below the crest, a little behind the slope.
const WEDGE: [f64; 3] = [-0.41 * 3.5, 0.91 * 3.5, 8.0];

#[test]
fn a_wedge_slides_out_of_a_slope() {
    let wedge = at(SLOPE, WEDGE);
    assert_eq!((wedge.mode, &wedge.on[..]), (BlockMode::SlidesOnTwo, &[0, 1][..]));
    // An independent vector solution.
    assert!((wedge.factor.unwrap() - 1.651_201).abs() < 1e-6, "{wedge:?}");
    let [plunge, trend] = wedge.plunge_trend.unwrap();
    assert!((plunge - 37.058_30).abs() < 5.1e-6 && (trend - 155.848_07).abs() < 5.1e-6);
    let without = at(&SLOPE.replace("cohesion = 20e3\n", ""), WEDGE);
    assert!((without.factor.unwrap() - 0.877_022).abs() < 1e-6, "{without:?}");
    // Weight is downward also without gravity in the deck.
    let default = at(&SLOPE.replace("gravity = [0, 0, -9.81]", ""), WEDGE);
    assert_eq!(default, wedge);
}

#[test]
fn verdicts_follow_the_excavation_supports_and_joints() {
    // Nothing is dug: the wedge is part of two blocks that reach to the sides of the region.
    let whole = SLOPE.split("[[remove]]").next().unwrap().to_owned();
    assert_eq!(at(&whole, WEDGE).mode, BlockMode::Held);
    let never = SLOPE.replace("from = 'dig'\n", "");
    assert_eq!(at(&never, WEDGE), at(SLOPE, WEDGE));
    assert_eq!(at(SLOPE, [0.41 * 5.0, -0.91 * 5.0, 5.0]).mode, BlockMode::Removed);
    assert_eq!(at(SLOPE, [-100.0, 100.0, 0.0]).mode, BlockMode::Held);
    let held = format!("{SLOPE}[[fix]]\nwhere = {{ z = 10 }}\naxes = 'xyz'\n");
    assert_eq!(at(&held, WEDGE).mode, BlockMode::Held);
    // Stronger joints by the name of their cut: F grows with tan φ on one of two sides.
    let joint = "[joints.rough]\nnormal_stiffness = 20e9\nshear_stiffness = 8e9\nfriction = 45.0\n";
    let assign = "[[assign]]\njoint = 'rough'\nwhere = { cut = 'left' }\n";
    let plain = SLOPE.replace("cohesion = 20e3\n", "");
    let rough = at(&format!("{plain}{joint}{assign}"), WEDGE).factor.unwrap();
    let sine = 37.058_30_f64.to_radians().sin();
    let exact = (0.673_312 + 0.242_106 * 30_f64.to_radians().tan()) / sine;
    assert!((rough - exact).abs() < 2e-6, "{rough} {exact}");
    for joint in ["", "jrc = 10.0\njcs = 50e6\nresidual_friction = 30.0\n"] {
        let text = SLOPE.replacen("friction = 30.0\ncohesion = 20e3\n", joint, 1);
        let wedge = at(&text, WEDGE);
        assert_eq!((wedge.mode, wedge.factor), (BlockMode::SlidesOnTwo, None));
    }
}

/// A pyramid in the roof of a level excavation falls, the rock between its planes in the floor stays.
#[test]
fn a_wedge_falls_out_of_a_roof() {
    let (materials, _) = SLOPE.split_once("[[region]]").unwrap();
    let planes = [30.0, 150.0, 270.0].map(|direction| {
        format!("[[cut]]\nplane = {{ dip = 60, dip_direction = {direction}, through = [0, 0, 2] }}\njoint = 'one'\n")
    });
    let text = format!(
        "{materials}[[region]]\nbox = {{ from = [-9, -9, -9], to = [9, 9, 9] }}\nmaterial = 'granite'\n{}
[[cut]]\nplane = {{ dip = 0, dip_direction = 0, through = [0, 0, 0] }}\njoin = true
[[remove]]\nwhere = {{ below = 0 }}\n",
        planes.concat()
    );
    let falls = at(&text, [0.0, 0.0, 0.5]);
    assert_eq!((falls.mode, falls.factor), (BlockMode::Falls, Some(0.0)));
    assert!((falls.plunge_trend.unwrap()[0] - 90.0).abs() < 1e-9);
    // Upside down: the excavation is above, and the wedge stands on its tip in the floor.
    let floor =
        text.replace("through = [0, 0, 2]", "through = [0, 0, -2]").replace("below", "above");
    assert_eq!(at(&floor, [0.0, 0.0, -0.5]).mode, BlockMode::Keyed);
    // Cut off from the excavation by a level joint, it has no free face.
    let lid =
        "[[cut]]\nplane = { dip = 0, dip_direction = 0, through = [0, 0, 0.5] }\njoint = 'one'\n";
    let buried = format!("{text}{lid}");
    assert_eq!(at(&buried, [0.0, 0.0, 0.8]).mode, BlockMode::Buried);
    assert_eq!(at(&buried, [0.0, 0.0, 0.3]).mode, BlockMode::Falls);
}

/// A slice between two smooth walls slides on one joint, behind a crack and out of a cut.
#[test]
fn smooth_walls_guide_a_block() {
    let (materials, _) = SLOPE.split_once("[[region]]").unwrap();
    let text = format!(
        "{materials}[[region]]\nbox = {{ from = [0, 0, 0], to = [10, 1, 10] }}\nmaterial = 'granite'
[[cut]]\nplane = {{ dip = 30, dip_direction = 90, through = [10, 0, 2] }}\njoint = 'one'
[[cut]]\nplane = {{ dip = 90, dip_direction = 90, through = [2, 0, 0] }}\njoint = 'other'
[[cut]]\nplane = {{ dip = 90, dip_direction = 90, through = [8, 0, 0] }}\njoin = true
[[remove]]\nwhere = {{ x = [8, 10] }}
[[fix]]\nwhere = {{ y = 0 }}\naxes = 'y'\n[[fix]]\nwhere = {{ y = 1 }}\naxes = 'y'\n"
    );
    let slides = at(&text, [5.0, 0.5, 9.0]);
    assert_eq!((slides.mode, &slides.on[..]), (BlockMode::SlidesOnOne, &[0][..]));
    let (dip, friction) = (30_f64.to_radians(), 30_f64.to_radians());
    let (area, volume) = (6.0 / dip.cos(), 48.0 - 30.0 * dip.tan());
    let weight = volume * 2600.0 * 9.81;
    let exact = friction.tan() / dip.tan() + 20e3 * area / (weight * dip.sin());
    assert!((slides.factor.unwrap() / exact - 1.0).abs() < 1e-12, "{slides:?} {exact}");
    let [plunge, trend] = slides.plunge_trend.unwrap();
    assert!((plunge - 30.0).abs() < 1e-9 && (trend - 90.0).abs() < 1e-9);
    assert_eq!(
        at(&text.replace("axes = 'y'", "axes = 'xy'"), [5.0, 0.5, 9.0]).mode,
        BlockMode::Held
    );
    let open = text.split("[[fix]]").next().unwrap();
    assert_eq!(at(open, [5.0, 0.5, 9.0]).mode, BlockMode::Held);
}

/// Rock beside a fracture holds the face unless the fracture covers all of it, or a joint bridges it.
#[test]
fn bridges_hold_or_slide() {
    let disc = |radius: f64, bridge: &str| {
        let disc = format!(
            "disc = {{ dip = 40, dip_direction = 130, centre = [0, 0, 0], radius = {radius} }}\n{bridge}"
        );
        SLOPE.replace("plane = { dip = 40, dip_direction = 130, through = [0, 0, 0] }\n", &disc)
    };
    assert_eq!(at(&disc(140.0, ""), WEDGE), at(SLOPE, WEDGE));
    let bridged = at(&disc(140.0, "bridge = 'other'\n"), WEDGE);
    assert_eq!(bridged, at(SLOPE, WEDGE));
}

#[test]
fn every_mode_has_a_word() {
    let all = [
        BlockMode::Buried,
        BlockMode::Held,
        BlockMode::Keyed,
        BlockMode::Falls,
        BlockMode::SlidesOnOne,
        BlockMode::SlidesOnTwo,
        BlockMode::Removed,
    ];
    insta::assert_snapshot!(all.map(BlockMode::name).join("\n"));
}

/// In plane strain all nodes are held along y: a block slides in the plane, also without joints at its
/// sides. The exact factor is tan 40° / tan 35°.
#[test]
fn blocks_slide_between_planes_of_symmetry() {
    let text = "
[materials.granite]
density = 2600.0
young = 50e9
poisson = 0.25
[joints.bedding]
normal_stiffness = 20e9
shear_stiffness = 8e9
friction = 40.0
[[region]]
prism = { outline = [[0, 0], [30, 0], [30, 10], [20, 10], [10, 30], [0, 30]], axis = 'y', from = 0, to = 2 }
material = 'granite'
[[cut]]
name = 'bedding'
plane = { dip = 35, dip_direction = 90, through = [13, 1, 24] }
joint = 'bedding'
[[fix]]
where = { z = 0 }
axes = 'xyz'
[[fix]]
where = { x = 0 }
axes = 'x'
[[fix]]
axes = 'y'
[[stage]]
name = 'rest'
kind = 'relax'
";
    let crest = at(text, [11.0, 1.0, 27.0]);
    assert_eq!((crest.mode, &crest.on[..]), (BlockMode::SlidesOnOne, &[0][..]));
    let exact = 40_f64.to_radians().tan() / 35_f64.to_radians().tan();
    assert!((crest.factor.unwrap() - exact).abs() < 1e-12, "{crest:?}");
    let [_, trend] = crest.plunge_trend.unwrap();
    assert!((trend - 90.0).abs() < 1e-9, "{trend}");
    // The bench carries the base.
    assert_eq!(at(text, [25.0, 1.0, 5.0]).mode, BlockMode::Held);
    // A support along all axes leaves no face free.
    let held = text.replace("[[fix]]\naxes = 'y'", "[[fix]]\naxes = 'xyz'");
    assert_eq!(at(&held, [11.0, 1.0, 27.0]).mode, BlockMode::Buried);
}
