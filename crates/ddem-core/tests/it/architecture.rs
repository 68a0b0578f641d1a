//! Import rules of the modules, and features that the method must not use.

use std::path::{Path, PathBuf};

/// Rows of modules from top to bottom; each row uses lower rows only.
const ROWS: [&[&str]; 10] = [
    &["run"],
    &["output"],
    &["step"],
    &["force"],
    &["state"],
    &["model"],
    &["joint"],
    &["mesh"],
    &["element", "law", "rigid", "collide"],
    &["math"],
];
/// Modules below all rows.
const LOWEST: [&str; 1] = ["error"];
/// Names of the lowest row that the top of the crate re-exports.
const RE_EXPORTED: [&str; 5] =
    ["Fault", "ModelError", "MovingBlock", "RunError", "debug_as_display"];

/// Crates of the method, each with the row prefix of its files if the whole crate is one row.
const CRATES: [(&str, &str); 4] =
    [("ddem-core", ""), ("ddem-joint", "joint/"), ("ddem-mesh", "mesh/"), ("ddem-mechanics", "")];

fn src(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name).join("src")
}

/// Path below `src` and text of each source file of the method, without `tests.rs`.
pub(crate) fn sources() -> Vec<(String, String)> {
    let mut folders: Vec<_> =
        CRATES.iter().map(|&(name, row)| (src(name), src(name), row)).collect();
    let mut sources = Vec::new();
    while let Some((folder, root, row)) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{error}")) {
            let path = entry.unwrap_or_else(|error| panic!("{error}")).path();
            if path.is_dir() {
                folders.push((path, root.clone(), row));
            } else if path.file_name().is_some_and(|name| name != "tests.rs") {
                let text = std::fs::read_to_string(&path).unwrap_or_default();
                let name = path.strip_prefix(&root).unwrap_or(&path).to_string_lossy();
                sources.push((format!("{row}{}", name.replace('\\', "/")), text));
            }
        }
    }
    sources.sort();
    assert!(sources.len() > 30, "sources not found");
    sources
}

/// Lines that are not comments, with their numbers.
fn code(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.lines().enumerate().map(|(i, line)| (i + 1, line));
    lines.filter(|(_, line)| !line.trim_start().starts_with("//"))
}

fn row(module: &str) -> Option<usize> {
    let lowest = LOWEST.contains(&module) || RE_EXPORTED.contains(&module);
    let row = ROWS.iter().position(|row| row.contains(&module));
    row.or_else(|| lowest.then_some(ROWS.len()))
}

/// Modules that a line names. Inside crates that are rows, `crate::` names their own modules.
fn named<'a>(module: &str, line: &'a str) -> impl Iterator<Item = &'a str> {
    let own = if ["joint", "mesh"].contains(&module) { None } else { Some("crate::") };
    let rows = [("ddem_joint", "joint"), ("ddem_mesh", "mesh")];
    let rows = rows.into_iter().filter(|(name, _)| line.contains(name)).map(|(_, row)| row);
    let all = own.into_iter().chain(["ddem_mechanics::"]);
    let named = all.flat_map(|path| line.match_indices(path)).map(|(at, found)| {
        let rest = &line[at + found.len()..];
        let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        &rest[..end.unwrap_or(rest.len())]
    });
    named.chain(rows)
}

#[test]
fn imports_point_to_lower_rows() {
    let mut wrong = Vec::new();
    for (file, text) in sources() {
        let module = file.split('/').next().unwrap_or(&file).trim_end_matches(".rs");
        if module == "lib" {
            continue;
        }
        let Some(from) = row(module) else {
            wrong.push(format!("{file}: module `{module}` is in no row"));
            continue;
        };
        for (number, line) in code(&text) {
            for used in named(module, line).filter(|used| *used != module) {
                match row(used) {
                    Some(to) if to > from => {}
                    Some(_) => wrong.push(format!("{file}:{number}: {module} -> {used}")),
                    None => wrong.push(format!("{file}:{number}: `{used}` is in no row")),
                }
            }
        }
    }
    assert!(wrong.is_empty(), "imports that do not go down:\n{}", wrong.join("\n"));
}

/// A line without its visibility, `const` and `async`.
fn item(line: &str) -> &str {
    let mut line = line.trim_start();
    if let Some(rest) = line.strip_prefix("pub") {
        let rest =
            rest.strip_prefix('(').and_then(|rest| rest.split_once(')')).map_or(rest, |r| r.1);
        line = rest.trim_start();
    }
    line.trim_start_matches("const ").trim_start_matches("async ")
}

/// Name at the start of a text.
fn name(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    &text[..end.unwrap_or(text.len())]
}

/// Named type whose `impl` block begins on this line.
fn implemented(line: &str) -> Option<&str> {
    let mut rest = line.strip_prefix("impl")?;
    let mut depth = 0;
    if rest.starts_with('<') {
        let ends = rest.find(|c: char| {
            depth += i32::from(c == '<') - i32::from(c == '>');
            depth == 0
        });
        rest = &rest[ends? + 1..];
    }
    let rest = rest.split_once(" for ").map_or(rest, |(_, of)| of);
    // A tuple has no name and no row.
    Some(name(rest.trim_start_matches([' ', '&']))).filter(|name| !name.is_empty())
}

#[test]
fn types_of_impl_blocks_are_found() {
    for (line, of) in [
        ("impl Model {", "Model"),
        ("impl<'a> Input<'a> {", "Input"),
        ("impl<S: Into<f64>> From<S> for Lanes {", "Lanes"),
        ("impl<'a> FromIterator<&'a Losses> for Lost {", "Lost"),
        ("impl std::error::Error for Fault {}", "Fault"),
    ] {
        assert_eq!(implemented(line), Some(of));
    }
    assert_eq!(item("    pub(in crate::run) const fn at("), "fn at(");
}

/// Methods of a type are in the row of the type.
#[test]
fn methods_are_in_the_row_of_their_type() {
    let sources = sources();
    let module =
        |file: &str| file.split('/').next().map(|name| name.trim_end_matches(".rs").to_owned());
    let mut homes = std::collections::BTreeMap::<&str, Vec<String>>::new();
    for (file, text) in &sources {
        for (_, line) in code(text) {
            let declared =
                ["struct ", "enum "].iter().find_map(|word| item(line).strip_prefix(word));
            declared
                .into_iter()
                .for_each(|of| homes.entry(name(of)).or_default().extend(module(file)));
        }
    }
    let mut wrong = Vec::new();
    for (file, text) in &sources {
        for (number, line) in code(text) {
            let home = implemented(line).and_then(|of| homes.get(of));
            if home.is_some_and(|home| module(file).is_some_and(|row| !home.contains(&row))) {
                wrong.push(format!("{file}:{number}: {line}"));
            }
        }
    }
    assert!(wrong.is_empty(), "methods outside the row of their type:\n{}", wrong.join("\n"));
}

#[test]
fn every_listed_module_exists() {
    let sources = sources();
    for module in ROWS.concat().into_iter().chain(LOWEST) {
        let found = sources.iter().any(|(file, _)| {
            *file == format!("{module}.rs") || file.starts_with(&format!("{module}/"))
        });
        assert!(found, "no module `{module}`");
    }
}

/// Only `mesh/` makes lattices. Above it, blocks have a `Topology`, edges, faces and neighbours
/// across these, so other block shapes need no other code there.
#[test]
fn only_mesh_uses_lattices() {
    // Strips and corners lie between blocks that share edges. They occur in lattices only, the fast
    // case.
    let strips = ["step/preconditioner/coupling.rs", "model/boundary/beside.rs"];
    // Re-exports, and the builder that makes a lattice for each single block.
    let builders = ["model/problem.rs", "model/problem/builder.rs", "step/tests.rs"];
    let above = &ROWS[..ROWS.iter().position(|row| row.contains(&"mesh")).unwrap_or(0)];
    let is_above = |file: &str| above.concat().contains(&file.split('/').next().unwrap_or(file));
    for (file, text) in sources().iter().filter(|(file, _)| is_above(file)) {
        for (number, line) in code(text) {
            let words = |of: &str| line.split(|c: char| !c.is_alphanumeric()).any(|w| w == of);
            let lattice = words("Lattice") || line.contains(".lattice(");
            let cells = [".lattices", ".cell.", ".cell["].iter().any(|word| line.contains(word));
            assert!(
                builders.contains(&&file[..]) || !(lattice || cells),
                "{file}:{number}: {line}"
            );
            let known = strips.contains(&&file[..]) || !line.contains(".neighbour(");
            assert!(known, "{file}:{number}: {line}");
        }
    }
}

#[test]
fn force_modules_do_not_import_each_other() {
    for (file, text) in sources().iter().filter(|(file, _)| file.starts_with("force/")) {
        for (number, line) in code(text) {
            let other = ["super::", "crate::force"].iter().any(|path| line.contains(path));
            assert!(!other, "{file}:{number}: {line}");
        }
    }
}

#[test]
fn core_avoids_forbidden_features() {
    let never = [
        ("mul_add", "the same bits on every machine"),
        ("std::time", "no clock"),
        ("std::fs", "no files"),
        ("std::env", "no environment"),
        ("println!", "no printing"),
        ("eprint", "no printing"),
        ("dbg!", "no printing"),
        ("unsafe ", "no unsafe code"),
        ("todo!", "nothing unfinished"),
        ("unwrap()", "no way to panic"),
    ];
    for (file, text) in sources() {
        for (number, line) in code(&text) {
            for (word, why) in never {
                assert!(!line.contains(word), "{file}:{number}: {why}: {line}");
            }
        }
    }
}

/// Such a sum would depend on the order of the threads.
#[test]
fn no_float_sum_depends_on_thread_order() {
    for (file, text) in sources() {
        let code: String = code(&text).flat_map(|(_, line)| [line.trim(), "\n"]).collect();
        for statement in code.split(';').filter(|s| s.contains("par_iter")) {
            for sum in [".sum(", ".sum::", ".reduce(", ".fold("] {
                assert!(!statement.contains(sum), "{file}: {statement}");
            }
        }
    }
}

#[test]
fn source_has_no_todo() {
    for (file, text) in sources() {
        assert!(!text.contains("TODO") && !text.contains("FIXME"), "{file}");
    }
}

#[test]
fn files_are_short() {
    for (file, text) in sources() {
        assert!(text.lines().count() < 400, "{file} has {} lines", text.lines().count());
    }
}

/// First line and number of lines of each function.
fn functions(text: &str) -> Vec<(&str, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let starts = lines.iter().enumerate().filter(|(_, line)| item(line).starts_with("fn "));
    let length = |(at, line): (usize, &&'_ str)| {
        let indent = &line[..line.len() - line.trim_start().len()];
        let ends =
            |line: &&str| line.strip_prefix(indent).is_some_and(|rest| rest.starts_with('}'));
        lines[at..].iter().position(ends).map_or(0, |last| last + 1)
    };
    starts.map(|(at, line)| (*line, length((at, line)))).collect()
}

#[test]
fn functions_are_short() {
    for (file, text) in sources() {
        for (line, length) in functions(&text) {
            assert!(length <= 60, "{file}: {length} lines in {line}");
        }
    }
}

/// Parameters of the function that begins here.
fn parameters(text: &str) -> &str {
    let Some(open) = text.find('(') else { return "" };
    let mut depth = 0;
    let close = text[open..].find(|c: char| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        depth == 0
    });
    &text[open..open + close.unwrap_or(0)]
}

#[test]
fn parameters_are_not_packed_into_tuples() {
    let packed = |parameters: &str| {
        let before = parameters.match_indices("): (").map(|(at, _)| &parameters[..at]);
        before.filter_map(|text| text.rsplit('(').next()).any(|pattern| pattern.contains(','))
    };
    assert!(packed("((a, b): (&A, &B), c: u8") && !packed("(a: u8, [b, c]: [u8; 2]"));
    for (file, text) in sources() {
        let starts = text.match_indices("fn ").map(|(at, _)| &text[at..]);
        for from in starts {
            let found = parameters(from);
            assert!(!packed(found), "{file}: {}{found}", from.lines().next().unwrap_or_default());
        }
    }
}
