//! Voronoi cells in decks, and messages about their seeds.

use ddem_deck::CutRock;

use crate::rock_decks;

/// Cube of 2 m with Voronoi cells.
fn text(cut: &str) -> String {
    format!(
        "
[materials.granite]
density = 2700.0
young = 50e9
poisson = 0.25
[joints.grain]
normal_stiffness = 20e9
shear_stiffness = 8e9
cohesion = 10e6
[[region]]
box = {{ from = [0, 0, 0], to = [2, 2, 2] }}
material = 'granite'
seed = 5
[[cut]]
{cut}
[[fix]]
where = {{ z = 0 }}
axes = 'xyz'
[[stage]]
name = 'rest'
kind = 'relax'
"
    )
}

fn cut(keys: &str) -> CutRock {
    rock_decks::cut(&text(&format!("{keys}\njoint = 'grain'")))
}

fn volume(rock: &CutRock) -> f64 {
    rock.properties.iter().map(|cell| cell.volume).sum()
}

#[test]
fn random_seeds_have_a_cell_each() {
    let rock = cut("voronoi = { number = 40, least = 0.3 }");
    assert_eq!(rock.properties.len(), 40);
    assert!((volume(&rock) - 8.0).abs() < 1e-12);
    // Every face between cells has a joint, and the same corners on both sides.
    assert!(rock.common.iter().all(|face| face.matches && rock.is_joint(face)));
    assert_eq!(
        rock.complex.points(),
        cut("voronoi = { number = 40, least = 0.3 }").complex.points()
    );
    assert_ne!(rock.complex.points(), cut("voronoi = { number = 40 }").complex.points());
}

#[test]
fn given_seeds_have_their_cells() {
    // The plane half way between the seeds cuts off a prism with the corners at x + y = 1.
    let rock = cut("voronoi = { points = [[0.25, 0.25, 1], [0.75, 0.75, 1]] }");
    let mut volumes: Vec<f64> = rock.properties.iter().map(|cell| cell.volume).collect();
    volumes.sort_by(f64::total_cmp);
    assert!((volumes[0] - 1.0).abs() < 1e-12 && (volumes[1] - 7.0).abs() < 1e-12);
}

#[test]
fn voronoi_cells_run() {
    let keys = "voronoi = { number = 12, least = 0.5 }\njoint = 'grain'";
    let built = rock_decks::built(&text(keys));
    assert_eq!(built.model().n_whole_blocks(), 12);
}

#[test]
fn wrong_seeds() {
    let mut found = Vec::new();
    for keys in [
        "voronoi = {}",
        "voronoi = { number = 1 }",
        "voronoi = { number = 100_000_000 }",
        "voronoi = { number = 10, least = -1 }",
        "voronoi = { number = 10, least = nan }",
        "voronoi = { number = 1000, least = 0.5 }",
        "voronoi = { number = 20, least = 1.05 }",
        "voronoi = { number = 10, points = [[0, 0, 0], [1, 1, 1]] }",
        "voronoi = { points = [[0, 0, 0], [1, 1, 1]], least = 0.1 }",
        "voronoi = { points = [[0, 0, 0]] }",
        "voronoi = { points = [[0, 0, 0], [1, 1, 1], [0, -0.0, 0]] }",
        "voronoi = { points = [[0, 0, 0], [1, inf, 1]] }",
        "voronoi = { points = [[0, 0, 0], [9, 9, 9]] }",
        "voronoi = { count = 3 }",
        "voronoi = { number = 9 }\nplane = { dip = 0, dip_direction = 0, through = [1, 1, 1] }",
        "voronoi = { number = 9 }\nbridge = 'grain'",
    ] {
        let of_cut = rock_decks::messages(&text(&format!("{keys}\njoint = 'grain'")));
        assert!(!of_cut.is_empty(), "nothing is said about {keys}");
        found.extend(of_cut.into_iter().filter(|one| !found.contains(one)).collect::<Vec<_>>());
    }
    insta::assert_snapshot!(found.join("\n"));
}
