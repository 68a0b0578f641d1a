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
        let mut text = String::from("\n| Key | Meaning | Unit | Default |\n|---|---|---|---|\n");
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

/// Places of a text that state a default: `default 3`, `the default is 3`, `3 by default`, and
/// `3, the default`. A number may also be code or a word in quotes.
fn stated_defaults(text: &str) -> Vec<String> {
    let value = |c: char| c.is_ascii_digit() || c == '`' || c == '"';
    let mut found = Vec::new();
    for (at, word) in text.match_indices("default") {
        let (before, after) = (&text[..at], &text[at + word.len()..]);
        let follows = ["s are ", " is ", " = ", ": ", " "]
            .iter()
            .find_map(|link| after.strip_prefix(link))
            .is_some_and(|after| after.starts_with(value));
        let precedes = [" by ", ", the ", " (", " as the "]
            .iter()
            .find_map(|link| before.strip_suffix(link))
            .is_some_and(|before| before.ends_with(value));
        if follows || precedes {
            let before: String = before.chars().rev().take(40).collect();
            let before: String = before.chars().rev().collect();
            found.push(format!("{before}{word}{}", after.chars().take(40).collect::<String>()));
        }
    }
    found
}

/// The text between the tables states no default: the tables do.
#[test]
fn pages_state_defaults_in_tables_only() {
    for stated in [
        "a pause, default 3",
        "The default is `[1, 2]`.",
        "with ζ = `damping`, 0.2 by default",
        "`kind = \"x\"`, the default, is",
        "the word \"all\" by default",
    ] {
        assert_eq!(stated_defaults(stated).len(), 1, "{stated}");
    }
    assert!(stated_defaults("damped by default, the default of `limit`").is_empty());
    for page in ["deck", "method", "python"] {
        let path = format!("docs/{page}.md");
        let text = std::fs::read_to_string(root().join(&path)).unwrap();
        let prose = text.lines().filter(|line| !line.starts_with('|'));
        let stated = stated_defaults(&prose.collect::<Vec<_>>().join(" "));
        assert!(stated.is_empty(), "{path}: {stated:#?}");
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

/// Attributes of a compiled class in a stub, one for each key of a table.
fn attributes(table: &str, indent: &str) -> String {
    keys(table).iter().map(|key| format!("{indent}{}\n", key.attribute())).collect()
}

/// Entries of a typed dictionary with the keys of a table: `Fix only from until`.
fn entries(words: &str, indent: &str) -> String {
    let (table, only) = words.split_once(" only ").unwrap_or((words, ""));
    let own = |key: &&DeckKey| only.is_empty() || only.split(' ').any(|name| name == key.name);
    keys(table).iter().filter(own).map(|key| format!("{indent}{}\n", key.entry())).collect()
}

/// Typed dictionary with the keys of a table, for keys that are words of Python.
fn dictionary(table: &str, _: &str) -> String {
    let keys = keys(table);
    let entries = keys.iter().map(|key| format!("\"{}\": {}", key.name, key.python_type()));
    let entries = entries.collect::<Vec<_>>().join(", ");
    format!("{table} = TypedDict(\"{table}\", {{{entries}}})\n")
}

/// Types of arguments, and attributes of materials and joints.
#[test]
fn python_types_match_schema() {
    let path = "crates/ddem-py/python/ddem/_types.py";
    let text = std::fs::read_to_string(root().join(path)).unwrap();
    let text = between(&text, ("# entries:", "# end"), &entries);
    expect(path, &between(&text, ("# dictionary:", "# end"), &dictionary));
    let path = "crates/ddem-py/python/ddem/_ddem.pyi";
    let text = std::fs::read_to_string(root().join(path)).unwrap();
    expect(path, &between(&text, ("# attributes:", "# end"), &attributes));
}

/// Forms of a definition: its words, its tables by their only key, and the types of other values.
fn forms_of(definition: &str) -> Vec<String> {
    let schema = json_schema();
    let definition = &schema["$defs"][definition];
    let all = ["oneOf", "anyOf"].iter().flat_map(|of| definition[of].as_array()).flatten();
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let form = |one: &Value| {
        let key = || one["properties"].as_object().and_then(|keys| keys.keys().next().cloned());
        let target = || text(&one["$ref"]).map(|target| target.replace("#/$defs/", ""));
        text(&one["const"]).or_else(target).or_else(key).or_else(|| text(&one["type"]))
    };
    all.map(|one| form(one).unwrap_or_else(|| panic!("{one}"))).collect()
}

/// Message about a deck with a wrong value.
fn refusal(deck: &str) -> String {
    match ddem_deck::parse(deck, "deck.toml") {
        Ok(_) => panic!("{deck} is a deck"),
        Err(error) => error.to_string(),
    }
}

/// The forms of a key are the same in the schema, in the reader and its messages, in the page and in
/// the types of Python.
#[test]
fn forms_match_schema() {
    let page = std::fs::read_to_string(root().join("docs/deck.md")).unwrap();
    for (definition, deck, bullet) in [
        ("Damping", "[[stage]]\nname = 's'\nkind = 'dynamic'\ndamping = ", "- `"),
        ("History", "[[load]]\nhistory = ", "- `history = "),
    ] {
        let forms = forms_of(definition);
        let message = refusal(&format!("{deck}true"));
        let is_table = |form: &&String| *form != "none";
        for form in &forms {
            let shown = if form == "none" { "`\"none\"".into() } else { format!("{{ {form} = ") };
            assert!(message.contains(&shown), "{form}: {message}");
            let listed = format!("{bullet}{}", shown.trim_start_matches('`'));
            assert!(page.contains(&listed), "docs/deck.md has no `{listed}`");
        }
        let tables = forms.iter().filter(is_table).count();
        assert_eq!(message.matches(" = ").count(), tables, "{message}");
        let unknown = refusal(&format!("{deck}{{ unknown = 1 }}"));
        forms.iter().filter(is_table).for_each(|form| {
            assert!(unknown.contains(&format!("`{form}`")), "{form}: {unknown}");
        });
    }
    let kinds = forms_of("Damping").into_iter().skip(1).map(|kind| format!("`{kind}`"));
    let kinds: Vec<String> = kinds.collect();
    let (last, first) = kinds.split_last().unwrap();
    let listed = format!("{} and {last}", first.join(", "));
    assert!(json_schema()["$defs"]["Stage"].to_string().contains(&listed), "{listed}");
    assert_eq!(forms_of("Sheet"), ["number", "topography", "Plane"]);
    assert_eq!(forms_of("Extent"), ["number", "array"]);
    let types = root().join("crates/ddem-py/python/ddem/_types.py");
    let types = std::fs::read_to_string(types).unwrap();
    for alias in [
        "Sheet: TypeAlias = Union[float, Plane, Topography]",
        "    topography: Path\n",
        "Extent: TypeAlias = Union[float, Sequence[float]]",
        "Damping: TypeAlias = Union[float, Literal[\"none\"], Mapping[str, float]]",
    ] {
        assert!(types.contains(alias), "{alias}");
    }
    let message = refusal("[[fix]]\nwhere = { above = true }\naxes = 'x'");
    for key in ["a level z", "topography = "].iter().chain(&ddem_deck::keys("Plane")) {
        assert!(message.contains(key), "{key}: {message}");
    }
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
    file("ModelTable", &[keys("Deck"), keys("ModelTable")].concat(), "\n");
    for table in [
        "Where",
        "Material",
        "Joint",
        "BlockSet",
        "RockRegion",
        "RockCut",
        "ContactTable",
        "LintTable",
        "OutputTable",
        "Assign",
        "Join",
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
