//! Rust 1.95 loses a number that is written into the copy of an array at an index known only at run
//! time. The source must not do this.

use crate::architecture::sources;

/// Name of a variable that a line declares as a mutable copy of another.
fn copy(line: &str) -> Option<&str> {
    let (name, of) = line.trim().strip_prefix("let mut ")?.split_once(" = ")?;
    let of = of.strip_suffix(';')?.trim_start_matches('*');
    let plain = |word: &str| word.chars().all(|c| c.is_alphanumeric() || c == '_');
    (plain(name) && plain(of)).then_some(name)
}

/// True if a line writes into the array `name` at an index that is a variable.
fn writes(line: &str, name: &str) -> bool {
    let rest = line.trim().strip_prefix(name).and_then(|rest| rest.strip_prefix('['));
    let Some((index, then)) = rest.and_then(|rest| rest.split_once("] ")) else { return false };
    let named = index.starts_with(char::is_alphabetic) && !index.contains(']');
    named && ["= ", "+= ", "-= ", "*= "].iter().any(|sign| then.starts_with(sign))
}

#[test]
fn array_copies_are_not_indexed_for_writing() {
    let faulty = ["let mut u = c;", "u[d] += 1;"];
    assert!(copy(faulty[0]).is_some_and(|name| writes(faulty[1], name)), "the search is blind");
    let mut found = Vec::new();
    for (path, text) in sources() {
        let lines: Vec<&str> = text.lines().collect();
        for (number, line) in lines.iter().enumerate() {
            let Some(name) = copy(line) else { continue };
            if lines[number..].iter().take(8).any(|line| writes(line, name)) {
                found.push((path.clone(), number + 1));
            }
        }
    }
    assert!(found.is_empty(), "write `moved_to` or `array::from_fn` at {found:?}");
}
