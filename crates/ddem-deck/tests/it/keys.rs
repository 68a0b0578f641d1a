//! Tables, docstrings and stubs that list the keys of a deck; all of them are written from the
//! schema.
//!
//! `DDEM_DOCS=1 cargo test -p ddem-deck --test it keys` writes them.

mod key;

use std::path::{Path, PathBuf};

use serde_json::Value;

use key::DeckKey;

fn json_schema() -> Value {
    ddem_deck::json_schema()
}

/// Keys of a table in the order of its struct, without those that are refused.
fn keys(table: &str) -> Vec<DeckKey> {
    let schema = json_schema();
    let definition = if table == "Deck" { &schema } else { &schema["$defs"][table] };
    let required: Vec<&str> =
        definition["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let all = definition["properties"].as_object().unwrap_or_else(|| panic!("no table {table}"));
    let is_allowed = |schema: &Value| {
        schema["description"].as_str().is_some_and(|text| !text.starts_with("Not allowed"))
    };
    all.iter()
        .filter(|(name, schema)| is_allowed(schema) && (table != "Deck" || *name == "title"))
        .map(|(name, schema)| DeckKey::new(name, schema, required.contains(&name.as_str())))
        .collect()
}

/// Keys of a table, or of one kind of stage, as in `Stage relax`.
fn keys_of(words: &str) -> Vec<DeckKey> {
    let Some((table, kind)) = words.split_once(' ') else { return keys(words) };
    let mut own: Vec<DeckKey> =
        keys(table).into_iter().filter_map(|key| key.of_kind(kind)).collect();
    // Arguments that are needed come first.
    own.sort_by_key(|key| key.optional);
    own
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Compares a file with its expected text, or writes it.
fn expect(path: &str, text: &str) {
    let path = root().join(path);
    if std::env::var_os("DDEM_DOCS").is_some() {
        std::fs::write(&path, text).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    let first = found.lines().zip(text.lines()).find(|(found, wanted)| found != wanted);
    assert!(found == text, "{} is not what the schema says: {first:?}", path.display());
}

/// Replaces the lines between those that begin with `begin` and `end`; `write` makes them from the
/// words after `begin`.
fn between(text: &str, (begin, end): (&str, &str), write: &dyn Fn(&str, &str) -> String) -> String {
    let mut out = String::new();
    let mut skips = false;
    for line in text.lines() {
        let indent = &line[..line.len() - line.trim_start().len()];
        skips &= !line.trim_start().starts_with(end);
        if !skips {
            out += line;
            out.push('\n');
        }
        if let Some(words) = line.trim().strip_prefix(begin) {
            skips = true;
            out += &write(words.trim_end_matches("-->").trim(), indent);
        }
    }
    out
}

#[test]
fn deck_page_tables_match_schema() {
    let path = "docs/deck.md";
    let page = std::fs::read_to_string(root().join(path)).unwrap();
    let table = |words: &str, _: &str| {
        let (table, prefix) = words.split_once(' ').unwrap_or((words, ""));
        let mut text =
            String::from("\n| DeckKey | Meaning | Unit | Default |\n|---|---|---|---|\n");
        keys(table).iter().for_each(|key| text += &(key.row(prefix) + "\n"));
        text + "\n"
    };
    let words = |definition: &str, _: &str| {
        let mut text = String::from("\n| Value | Meaning | Unit |\n|---|---|---|\n");
        words_of(definition).iter().for_each(|word| text += &(word.row_of_word() + "\n"));
        text + "\n"
    };
    let page = between(&page, ("<!-- keys:", "<!-- end -->"), &table);
    expect(path, &between(&page, ("<!-- words:", "<!-- end -->"), &words));
}

/// Words that a key may have.
fn words_of(definition: &str) -> Vec<DeckKey> {
    let schema = json_schema();
    let all = schema["$defs"][definition]["oneOf"].as_array().into_iter().flatten();
    let word = |one: &Value| DeckKey::new(&one["const"].to_string(), one, true);
    all.map(word).collect()
}

/// The text between the tables states no default: the tables do.
#[test]
fn deck_page_states_defaults_in_tables_only() {
    let page = std::fs::read_to_string(root().join("docs/deck.md")).unwrap();
    let prose = page.lines().filter(|line| !line.starts_with('|'));
    let prose = prose.collect::<Vec<_>>().join(" ");
    for after in prose.split("default ").skip(1) {
        let stated = after.starts_with(|c: char| c.is_ascii_digit() || c == '`' || c == '"');
        assert!(!stated, "default {}", after.chars().take(60).collect::<String>());
    }
}

/// Arguments of a stub with the keys of a table: `Fix but axes`, `Stage dynamic only damping
/// time_step`.
fn arguments(words: &str, indent: &str) -> String {
    let (words, only) = words.split_once(" only ").unwrap_or((words, ""));
    let (table, but) = words.split_once(" but ").unwrap_or((words, ""));
    let own = |key: &&DeckKey| {
        let in_list = |list: &str| list.split(' ').any(|name| name == key.name);
        let own = !["where", "from", "until"].contains(&key.name.as_str());
        own && !in_list(but) && (only.is_empty() || in_list(only))
    };
    let line = |key: &DeckKey| format!("{indent}{}\n", key.argument());
    keys_of(table).iter().filter(own).map(line).collect()
}

/// Parameters of a docstring.
fn parameters(keys: &[DeckKey]) -> String {
    keys.iter().map(DeckKey::parameter).collect::<Vec<_>>().join("\n")
}

/// Arguments of the compiled part, and arguments and parameters of the search for a factor of
/// safety.
#[test]
fn python_stubs_match_schema() {
    let written = |file: &str| {
        let path = format!("crates/ddem-py/python/ddem/{file}");
        let text = std::fs::read_to_string(root().join(&path)).unwrap();
        (path, between(&text, ("# keys:", "# end"), &arguments))
    };
    let (path, stub) = written("_ddem.pyi");
    expect(&path, &stub);
    let (path, script) = written("_safety.py");
    let (before, rest) = script.rsplit_once("    bracket : ").unwrap();
    let (_, after) = rest.split_once("    threads : ").unwrap();
    let list = parameters(&keys_of("Stage safety")).replace('\n', "\n    ");
    let list = list.replace("joints : list of str", "joints : str or list of str");
    expect(&path, &format!("{before}    {list}\n    threads : {after}"));
}

/// Parameters of the methods of models and simulations, which sources of `ddem-py` include.
#[test]
fn python_docstrings_match_schema() {
    let file = |name: &str, keys: &[DeckKey], end: &str| {
        let text = format!("Parameters\n----------\n{}{end}", parameters(keys));
        expect(&format!("crates/ddem-py/src/keys/{name}.txt"), &text);
    };
    // Further parameters follow these lists.
    file("Relax", &keys_of("Stage relax"), "");
    file("Run", &keys_of("Stage dynamic"), "");
    let mut start = keys_of("Stage dynamic");
    start.retain(|key| ["damping", "time_step"].contains(&key.name.as_str()));
    file("Start", &start, "\n");
    for table in [
        "ModelTable",
        "Material",
        "Joint",
        "BlockSet",
        "ContactTable",
        "LintTable",
        "Assign",
        "Remove",
        "Refine",
        "Fix",
        "Load",
        "Charge",
        "Boundary",
        "Initial",
        "Stage",
        "Probe",
    ] {
        file(table, &keys(table), "\n");
    }
}

/// Every key of a stage says which kinds of stages have it.
#[test]
fn keys_of_stages_name_their_kinds() {
    use ddem_deck::{StageKind, stage_keys};
    let kinds = [StageKind::Relax, StageKind::Dynamic, StageKind::Safety];
    for key in ddem_deck::keys("Stage").iter().filter(|key| !["name", "kind"].contains(key)) {
        assert!(kinds.iter().any(|&kind| stage_keys(kind).contains(key)), "`{key}` names no kind");
    }
    assert!(stage_keys(StageKind::Safety).contains(&"tolerance"));
}
