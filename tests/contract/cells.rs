//! Cells of regions: the same bits however they are run, and results by whole blocks.

use ddem_core::Simd;

use super::bits::output_bits;
use super::decks::CELLS;
use super::resume::everything;
use super::shared::{Frames, How, deck, run, run_into};

/// Deck of two regions on a set of blocks, all joined. Its joints are ten times as strong, so that it
/// rests at once.
fn beside() -> String {
    let strong = [("2e4", "2e5"), ("1e4", "1e5"), ("[4e5, 2e5, 1e5]", "[4e6, 2e6, 1e6]")];
    let strong = strong.iter().fold(CELLS.to_owned(), |text, (old, new)| text.replace(old, new));
    let below = strong.replace("where = { z = 0.0 }", "where = { z = -1.0 }");
    let joined = below.replace("divisions = 4", "divisions = 2\njoint = 'seam'");
    let more = "[[blocks]]\nname = 'bed'\norigin = [0, 0, -1]\nsize = [3, 3, 1]\ncount = [2, 2, 1]\n\
                divisions = 2\nmaterial = 'rock'\njoint = 'seam'\n\
                [[region]]\nname = 'side'\nbox = { from = [3, 0, 0], to = [4, 3, 3] }\n\
                material = 'rock'\ndivisions = 2\njoint = 'seam'\n\
                [[fix]]\nwhere = { set = 'side' }\naxes = 'xyz'\n[[cut]]\n";
    joined.replacen("[[cut]]\n", more, 1)
}

/// Decks with deformable cells, with rigid ones, with both, and with blocks of a set beside them.
fn bodies() -> [String; 4] {
    let with = |keys: &str| CELLS.replace("divisions = 4", keys);
    let mixed = with("divisions = 2\nsmall = { width = 0.9, is = 'rigid' }");
    let model = deck(&mixed).build().expect("a model");
    let rigid = (0..model.n_blocks()).filter(|&block| model.is_rigid(block)).count();
    assert!(0 < rigid && rigid < model.n_blocks(), "{rigid} of {} rigid", model.n_blocks());
    [CELLS.to_owned(), with("body = 'rigid'"), mixed, beside()]
}

#[test]
fn fields_of_cells_are_identical_for_any_threads_and_simd() {
    assert!(deck(CELLS).build().expect("a model").n_nodes() > 3000);
    for text in bodies() {
        let expected = output_bits(&text, 1, Simd::default(), 200);
        assert!(expected.0 != [0; 2], "no pair fails");
        for threads in [2, 3] {
            let found = output_bits(&text, threads, Simd::default(), 200);
            assert!(found == expected, "{threads} threads");
        }
        for (name, simd) in Simd::available() {
            assert!(output_bits(&text, 1, simd, 200) == expected, "{name}");
        }
    }
}

#[test]
fn run_of_cells_resumes_to_the_same_bits() {
    let folder = || tempfile::tempdir().expect("a folder");
    for text in bodies() {
        let (whole, parts) = (folder(), folder());
        assert!(run_into(&text, whole.path(), How::default()));
        let stopped = How { stop_after: Some(60), ..How::default() };
        assert!(!run_into(&text, parts.path(), stopped), "the run ended early");
        let resumed = How { threads: 2, resume: true, ..How::default() };
        assert!(run_into(&text, parts.path(), resumed));
        assert!(everything(whole.path()) == everything(parts.path()));
    }
}

/// Tied nodes have equal bits, and the files number blocks as `ddem cut` does.
#[test]
fn copies_stay_equal_and_blocks_have_the_numbers_of_their_cells() {
    let model = deck(CELLS).build().expect("a model");
    let rock = deck(CELLS).cut_regions().expect("cells");
    let last = *rock.blocks.iter().max().expect("a cell") as usize;
    assert!(last + 1 < rock.blocks.len(), "no cells are joined");
    assert_eq!(model.n_whole_blocks(), last + 1);
    let run = run(CELLS);
    assert_eq!(run.summary.blocks, last as u64 + 1);
    let frames = Frames::open(run.path("blocks.vtkhdf"));
    let moved = frames.last_vectors("displacement");
    let velocities = frames.last_vectors("velocity");
    let mut groups = 0;
    for nodes in model.geometry().ties.groups() {
        let bits = |field: &[[f64; 3]], node: u32| field[node as usize].map(f64::to_bits);
        for &node in nodes {
            assert_eq!(bits(&moved, node), bits(&moved, nodes[0]));
            assert_eq!(bits(&velocities, node), bits(&velocities, nodes[0]));
        }
        groups += 1;
    }
    assert!(groups > 1000);
}
