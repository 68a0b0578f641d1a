//! Every text of a message in the sources is in a committed snapshot.

use std::fs;
use std::path::{Path, PathBuf};

use ddem_core::ErrorCode;
use ddem_deck::lint::Code;

use crate::notation::{literals, sources};

/// Crates with messages.
const CRATES: [&str; 6] =
    ["ddem-mechanics", "ddem-mesh", "ddem-core", "ddem-deck", "ddem-io", "ddem-cli"];

/// Files whose texts are reports, progress or names, not messages.
const REPORTS: [&str; 6] = [
    "ddem-cli/src/progress.rs",
    "ddem-core/src/error/code.rs",
    "ddem-deck/src/lint.rs",
    "ddem-deck/src/schema/examples.rs",
    "ddem-io/src/run/plan.rs",
    "ddem-io/src/summary/table.rs",
];

/// Ends of the lines before texts that are not messages: of panics, attributes, comparisons and progress.
const UNSEEN: [&str; 11] = [
    ".expect(",
    "assert!(",
    "assert_eq!(",
    "unreachable!(",
    "panic!(",
    "reason =",
    "after_help =",
    "const PROBE: &str =",
    "has(",
    "screen.line(",
    "screen.line(&format!(",
];

/// Lines of the report on a deck.
const LINES: [&str; 3] = [
    "can fail       {joints} joints, {pairs} pairs",
    "contacts       {near} pairs of blocks near each other at the start",
    " while joints hold",
];

/// Largest number of characters that a value in a message has.
const LONGEST: usize = 400;

/// Texts that no snapshot shows yet, by the file that has them; none may be added.
#[rustfmt::skip]
const NOT_YET_SHOWN: &[&str] = &[
    // ddem-deck/build/warnings.rs
    "{n} faces are left out, because other blocks cover them in part; the first",
    // ddem-cli/advice.rs
    ": wait until it has finished or give another --out",
    ": free some space or give another --out",
    // ddem-cli/main.rs
    "error: cannot write to standard output: {error} [{code}]\n",
    // ddem-cli/plot.rs
    "pictures need Python with the module ddem and PyVista: looked for them with {searched}\n  install them by `{python} -m pip install '.[plot]'` in the folder of the sources of ddem",
    "there is no picture",
    // ddem-core/model/access.rs
    "there is no strength to divide: no joint can fail, and blocks do not meet",
    "give joints `friction`, `cohesion` or `tension`, or let blocks meet",
    // ddem-core/model/block_boxes.rs
    "no element is at {point:?}: coordinates must be finite",
    "no node is nearest to {at:?}: coordinates must be finite",
    // ddem-core/model/boundary/mod.rs
    "there is no such wave",
    // ddem-core/model/computed.rs
    "no joint has this name",
    // ddem-core/model/conditions.rs
    "there is no such entry",
    // ddem-core/model/elements.rs
    "block {block} has no element at {at:?}: it has {n} along each edge, from 0",
    // ddem-core/model/excavation.rs
    "there are {found} {what} for the {n} nodes of the model",
    // ddem-core/model/history.rs
    "it gave {factor}, which is not a finite number",
    // ddem-core/model/mechanism.rs
    "translation ({:.3}, {:.3}, {:.3}) with rotation ({:.3}, {:.3}, {:.3})",
    // ddem-core/model/problem/build_error.rs
    "there is no {what} {number}: there are {count}, from 0",
    "nodes {quad:?} are no part of a face of a block",
    "blocks {blocks:?} cannot be joined by joint `{joint}`: {why}",
    "there are {count} {what}: {} are the most",
    "the law of joint `{joint}`: {why}",
    "node {node} is inside of rigid block {block}, of which only the corners are nodes",
    // ddem-core/model/problem/builder.rs
    "node of a block",
    "another joint or pair of faces joins them already",
    "both faces are of one block",
    "the faces do not face each other",
    "the faces do not overlap",
    "the faces are {:.4e} m apart and the joint is {:.4e} m thick",
    // ddem-core/output/snapshot.rs
    "`{}` has no values {range:?}: it has {n}",
    "room for the values {range:?} of `{}`",
    // ddem-core/run/conditions.rs
    "there is no stage {stage}: the model has {n}, from 0",
    // ddem-core/run/mod.rs
    "there are {found} forces for {n} nodes",
    // ddem-core/run/saved/check.rs
    "nonconforming joints of another model",
    "invalid travel of blocks",
    "contacts of blocks that do not exist",
    "contacts in a model without contact",
    "contacts of another number of blocks",
    "failed joints that do not exist",
    "wrong number of joints",
    "wrong number of peaks",
    "invalid pose of a rigid block",
    "wrong number of free-field columns or charges",
    "forces on nodes that do not exist",
    "wrong number of load factors",
    "wrong number of nodes",
    "more failed pairs than the model has",
    "invalid step counts",
    "invalid removed blocks",
    "invalid previous stage",
    "the model has no such stage",
    // ddem-core/run/saved/mod.rs
    "bytes after the end",
    "gas surfaces of charges",
    "the saved state has format {found}; this version of ddem reads format {FORMAT}: resume with the version that wrote it, or run from the start",
    "it belongs to another model, with {saved} {what} instead of {model}",
    "its state is damaged: {what}",
    "rigid packs of blocks",
    "pairs of points at joints",
    "factors of loads",
    "levels of free-field columns",
    // ddem-deck/build/charge/mod.rs
    "there is a cavity, but gas does not push faces that do not match: `[[refine]]` a block more on all sides of it, so that the blocks around it are split as it is",
    // ddem-deck/reader/de/access.rs
    "a value was read before its key",
    // ddem-deck/reader/files.rs
    "this is no CSV: {error}",
    "{} points with {size} are no grid",
    // ddem-io/checkpoint.rs
    "it is a folder",
    "the checkpoint is damaged ({e})",
    "not a checkpoint of ddem",
    "the checkpoint has format {version}, written by {other} version of ddem; this one reads format {VERSION}: resume with the version that wrote it, or run from the start",
    "the checkpoint has no format number ({e})",
    "`{name}` has no bytes",
    "`{name}` is longer than the file",
    // ddem-io/folder.rs
    "moving results to",
    // ddem-io/hdf.rs
    "not a complete HDF5 file ({error})",
    "a table of one or two dimensions was expected",
    "{name} has {shape:?} rows instead of {rows} or more",
    // ddem-io/run/drive.rs
    "it was written by another version of the deck",
    "it was written with another content of `{path}`",
    // ddem-io/run/open_stage.rs
    "a session has no stage that searches for a factor of safety",
    "`Simulation::factor_of_safety` finds that of the present state",
    "`{}` comes before `{}`, which has begun: stages are entered forwards only",
    "load a state that was saved before to go back",
    "the model has a stage `{near}`, but none named `{}`: its supports and loads do not come into force",
    // ddem-io/run/resume.rs
    "it is damaged ({e})",
    "the program that saved it computed `{computed}`, which a deck cannot do: resume it in that program",
    // ddem-io/run/safety.rs
    "the trial with strengths / {unstable:.4} was undecided after {steps} steps and counts as unstable: the factor of safety may be larger",
    "strengths / {factor:.4} came to rest, but strengths / {unstable:.4} did not: the factor of safety may be as large as {factor:.4}",
    "search again with a `bracket` above {unstable:.4}",
    "; no joint carries any load: check `gravity` and the supports",
    "; joint `{joint}` has no strength and never fails",
    // ddem-io/run/session.rs
    "it is not complete",
    "it was written by another model",
    // ddem-io/run/warnings.rs
    " in contacts that form, separate and rotate",
    // ddem-io/tables.rs
    "a row has {have} values instead of {want}",
    "does not begin with the columns stage,step,time",
    "has {have} rows, but the run to resume had written {rows}",
    // ddem-io/vtkhdf/data.rs
    "a cell names point {id}, but there are {points} points",
    "`{name}` has {have} values instead of {rows}",
    "is not a name for an array",
    "is the name of two arrays",
    "`{}` has no components",
    // ddem-io/vtkhdf/results.rs
    "there is no array `{name}`",
    "there is no step {step}: the file has {steps}",
    "rows {first} to {} are not in the file",
    // ddem-io/vtkhdf/writer.rs
    "`{}` is a field of cells, but the file has points only",
    "either the mesh or each step has the points",
    "not a VTKHDF file with time steps ({e})",
    "has {have} steps, but the run to resume had written {steps}",
    "was written with other fields: no such `{}`",
    "{name} has too few entries",
    // ddem-mechanics/law/check.rs
    "tension() is {tension}, expected 0 or more",
    "tan_dilation() is {dilation}, expected 0 or more",
    "softening() is {opening} m and {sliding} J/m², expected 0 or more",
    "peak({normal}) is {peak}, expected 0 Pa or more",
    "under {normal} Pa a shear of {beyond} Pa is above peak(), and failure() or any_failure() does not say so",
    "under {normal} Pa a shear of {below} Pa is below peak(), and failure() or any_failure() says that it fails",
    "residual({normal}) is {residual}, expected 0 Pa or more",
    "residual({normal}) is {residual} Pa, less than the {lifts} Pa that tan_dilation() takes: sliding would make energy",
    "contact_strength({normal}) is {strength}, expected 0 Pa or more",
    "contact_strength({normal}) is {strength}, expected 0 Pa: bare faces have no cohesion",
    "tan_contact_friction() is {tan}, expected 0 or more",
    "contact_strength({normal}) is {strength}, and tan_contact_friction() says {}: expected the same",
    // ddem-mesh/conforming.rs
    "its nodes have numbers of 32 bits",
    // ddem-mesh/hexmesh.rs
    "the hexahedron of nodes {hex:?} is no cell of its grid",
    // ddem-mesh/lib.rs
    "there is no node {node}: the model has {n} nodes, from 0",
    "there is no block {block}: the model has {n} blocks, from 0",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Texts of all committed snapshots, cut at the codes of messages, with single spaces.
fn snapshots(folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            snapshots(&path, found);
        } else if path.extension().is_some_and(|end| end == "snap") {
            let text = fs::read_to_string(&path).unwrap();
            let (_, text) = text.split_once("\n---\n").unwrap();
            let mut text = text.replace('│', " ");
            let errors = ErrorCode::ALL.iter().map(|code| code.name());
            for code in errors.chain(Code::ALL.iter().map(|code| code.name())) {
                text = text.replace(&format!("[{code}]"), "\0");
            }
            found.extend(text.split('\0').map(spaced));
        }
    }
}

/// Text with one space for each gap, also at its ends.
fn spaced(text: &str) -> String {
    let words: Vec<&str> = text.split_whitespace().collect();
    let gap = |there: bool| if there { " " } else { "" };
    let (first, last) =
        (text.starts_with(char::is_whitespace), text.ends_with(char::is_whitespace));
    if words.is_empty() {
        return gap(first).to_owned();
    }
    format!("{}{}{}", gap(first), words.join(" "), gap(last))
}

/// Parts of a format between its values.
fn parts(format: &str) -> Vec<String> {
    // The snapshots are cut at codes.
    let plain = format.replace(" [{}]", "").replace(" [{code}]", "");
    let plain = plain.replace("{{", "\u{1}").replace("}}", "\u{2}");
    let mut parts = Vec::new();
    let mut rest = plain.as_str();
    while let Some((before, after)) = rest.split_once('{') {
        parts.push(before);
        rest = after.split_once('}').map_or("", |(_, after)| after);
    }
    parts.push(rest);
    let whole = |part: &str| spaced(&part.replace('\u{1}', "{").replace('\u{2}', "}"));
    parts.into_iter().map(whole).filter(|part| !part.is_empty()).collect()
}

/// True if the parts follow each other in a text, with at most a value between them.
fn is_in(parts: &[String], text: &str) -> bool {
    let Some((first, others)) = parts.split_first() else { return true };
    text.match_indices(first.as_str()).any(|(at, _)| {
        let mut end = at + first.len();
        others.iter().all(|part| match text[end..].find(part.as_str()) {
            Some(gap) if gap <= LONGEST => {
                end += gap + part.len();
                true
            }
            _ => false,
        })
    })
}

/// Number of words with a letter.
fn words(text: &str) -> usize {
    text.split_whitespace().filter(|word| word.contains(char::is_alphabetic)).count()
}

/// Texts of messages in a source: those of three words or more.
fn texts(source: &str) -> Vec<String> {
    let own = source.split("#[cfg(test)]").next().unwrap();
    let seen = |at: usize| {
        let before = own[..at].trim_end();
        !UNSEEN.iter().any(|unseen| before.ends_with(unseen))
    };
    let all = literals(own).into_iter().filter(|(at, _)| seen(*at)).map(|(_, text)| text);
    let enough = |text: &String| {
        let longest = parts(text).iter().map(|part| words(part)).max();
        !LINES.contains(&text.as_str())
            && words(text) >= 3
            && longest.is_some_and(|longest| longest >= 2)
    };
    all.filter(enough).collect()
}

/// A message that no snapshot shows could become wrong without notice. `NOT_YET_SHOWN` must shrink:
/// an entry that a snapshot shows, or that no source has, fails, too.
#[test]
fn every_message_is_in_a_snapshot() {
    let mut shown = Vec::new();
    snapshots(&root(), &mut shown);
    let mut paths = Vec::new();
    CRATES.iter().for_each(|name| sources(&root().join(name).join("src"), &mut paths));
    let (mut missing, mut left) = (Vec::new(), NOT_YET_SHOWN.to_vec());
    for path in paths.iter().filter(|path| !REPORTS.iter().any(|report| path.ends_with(report))) {
        for text in texts(&fs::read_to_string(path).unwrap()) {
            let parts = parts(&text);
            if shown.iter().any(|shown| is_in(&parts, shown)) {
                continue;
            }
            match NOT_YET_SHOWN.iter().any(|known| *known == text) {
                true => left.retain(|known| *known != text),
                false => missing.push(format!("{}: {text:?}", path.display())),
            }
        }
    }
    assert!(missing.is_empty(), "no snapshot shows\n{}", missing.join("\n"));
    assert!(left.is_empty(), "shown, or gone from the sources: {left:#?}");
}
