//! Defaults: those that the texts of the schema state, those of the schema, and those that an
//! omitted key has.

use std::path::Path;

use ddem_core::Simulation;
use ddem_core::problem::FRICTION;
use ddem_deck::{BuiltDeck, Deck, Probe, Stage, from_table, json_schema, read_files};
use serde_json::{Value, json};
use toml::Table;

/// Words that state a default without a value.
const WORDS: [&str; 19] = [
    "none",
    "none: never in the model",
    "none: brittle",
    "none: parallel",
    "all",
    "all sets",
    "all, and the friction of contacts",
    "any",
    "everywhere",
    "everything",
    "the first",
    "constant",
    "at rest",
    "even cuts",
    "that of the two faces",
    "the `joint` of the set",
    "the middle of the regions",
    "0.005 of the diagonal of the regions",
    "that of its keys",
];
/// Defaults that follow from other keys; `defaults_that_follow_from_other_keys` checks them.
const RULES: [(&str, &str); 4] = [
    ("ModelTable", "contact"),
    ("Joint", "residual_friction"),
    ("Charge", "history"),
    ("Probe", "every"),
];
/// Words for a value.
fn in_words(words: &str) -> Option<Value> {
    match words {
        "empty" => Some(json!("")),
        "the coordinate axes" => Some(json!([[1, 0, 0], [0, 1, 0], [0, 0, 1]])),
        _ => None,
    }
}

/// Conditions under which another value than the stated one holds.
fn conditions() -> [(&'static str, String); 4] {
    let driven = Simulation::DRIVEN_INCREMENTS;
    [
        ("increments", format!(", {driven} with supports driven by a `displacement`")),
        ("friction", format!(", {FRICTION} if neither has one")),
        ("damping", ", 0 while waves of a charge cross the model".to_owned()),
        ("release", ": at once".to_owned()),
    ]
}

/// A key with the default that its text states and that of the schema.
#[derive(Debug)]
struct Default {
    table: String,
    key: String,
    stated: String,
    schema: Value,
}

impl Default {
    /// Value at the beginning of the text, and the rest of the text.
    fn value(&self) -> Option<(Value, &str)> {
        if let Some(value) = in_words(&self.stated) {
            return Some((value, ""));
        }
        let (literal, rest) = match self.stated.strip_prefix('`') {
            Some(code) => code.split_once('`')?,
            None => self.stated.split_at(self.stated.find([',', ':']).unwrap_or(self.stated.len())),
        };
        Some((serde_json::from_str(&literal.replace(' ', "")).ok()?, rest))
    }

    fn is_rule(&self) -> bool {
        RULES.contains(&(self.table.as_str(), self.key.as_str()))
    }
}

/// All keys of the schema with a default.
fn defaults() -> Vec<Default> {
    let schema = json_schema();
    let mut found = Vec::new();
    collect("Deck", &schema, &mut found);
    for (name, definition) in schema["$defs"].as_object().unwrap() {
        collect(name, definition, &mut found);
    }
    assert!(found.len() > 60, "{}", found.len());
    found
}

/// Adds the keys of a table, and of tables inside.
fn collect(table: &str, schema: &Value, found: &mut Vec<Default>) {
    for (key, property) in schema["properties"].as_object().into_iter().flatten() {
        let text = property["description"].as_str().unwrap_or_default().replace('\n', " ");
        if let Some((_, stated)) = text.trim_end_matches('.').rsplit_once("; default ") {
            let (table, key, stated) = (table.to_owned(), key.clone(), stated.to_owned());
            found.push(Default { table, key, stated, schema: property["default"].clone() });
        }
    }
    for inner in ["anyOf", "oneOf"].iter().filter_map(|of| schema[*of].as_array()).flatten() {
        collect(table, inner, found);
    }
}

/// True for equal values, whole numbers and others alike.
fn same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => a.as_f64() == b.as_f64(),
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b))
        }
        _ => a == b,
    }
}

#[test]
fn texts_state_the_defaults_of_the_schema() {
    let conditions = conditions();
    for default in defaults() {
        let Default { key, stated, schema, .. } = &default;
        if default.is_rule() {
            assert!(schema.is_null(), "{default:?}");
            continue;
        }
        match default.value() {
            None => {
                let absent = schema.is_null() || *schema == json!([]);
                let own = conditions.iter().filter(|(of, _)| of == key);
                let plain = own.fold(stated.as_str(), |text, (_, end)| {
                    text.strip_suffix(end.as_str()).unwrap_or(text)
                });
                assert!(WORDS.contains(&plain) && absent, "{default:?}");
            }
            Some((value, rest)) => {
                assert!(same(&value, schema), "{default:?}: the schema has {schema}");
                let known = |(of, text): &(&str, String)| of == key && text == rest;
                assert!(rest.is_empty() || conditions.iter().any(known), "{default:?}");
            }
        }
    }
}

/// Deck in which every key with a default has an effect.
const BASE: &str = r#"
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
normal_stiffness = 1e10
shear_stiffness = 1e10
friction = 30
[joints.glued]
normal_stiffness = 1e10
shear_stiffness = 1e10
cohesion = 1e6
[[blocks]]
name = "box"
origin = [0, 0, 2]
size = [4, 4, 4]
count = [4, 4, 4]
material = "rock"
joint = "seam"
divisions = 1
[[blocks]]
size = [1, 1, 1]
material = "rock"
joint = "seam"
[[assign]]
where = { dip = 0 }
joint = "glued"
[[remove]]
where = { x = [1.1, 1.9], y = [1.1, 1.9], z = [3.1, 3.9], set = "box" }
[[remove]]
where = { x = [3.1, 3.9], y = [3.1, 3.9], z = [5.1, 5.9], set = "box" }
from = "move"
[[fix]]
axes = "xyz"
[[charge]]
where = { sphere = { centre = [1.5, 1.5, 3.5], radius = 1.0 } }
pressure = 1e6
from = "move"
[[initial]]
where = { x = [0, 1] }
spin = [0, 0, 1]
[[stage]]
name = "rest"
kind = "relax"
[[stage]]
name = "move"
kind = "dynamic"
duration = 1.0
[[stage]]
name = "safety"
kind = "safety"
[[probe]]
name = "corner"
at = [0, 0, 0]
"#;

/// Deck with a region and a cut in which every key of theirs with a default has an effect.
const ROCK: &str = r#"
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
normal_stiffness = 1e10
shear_stiffness = 1e10
[[region]]
box = { from = [0, 0, 0], to = [4, 4, 4] }
material = "rock"
[[cut]]
set = { dip = 40, dip_direction = 130, fisher = 20, spacing = { mean = 1, law = "exponential" } }
joint = "seam"
[[cut]]
set = { dip = 80, dip_direction = 10, spacing = 1, persistence = 0.5 }
joint = "seam"
[[cut]]
dfn = { number = 9, size = { power = 3, from = 0.5, to = 2 }, dip = 20, dip_direction = 70 }
joint = "seam"
[[cut]]
voronoi = { number = 5 }
joint = "seam"
"#;

/// Place in `BASE` or `ROCK` and another value of each key with a default.
fn places() -> Vec<(&'static str, &'static str, &'static str, Value)> {
    vec![
        ("Deck", "title", "", json!("a title")),
        ("ModelTable", "gravity", "model", json!([0, 0, -1])),
        ("ModelTable", "kinematics", "model", json!("small")),
        ("ModelTable", "element", "model", json!("standard")),
        ("ModelTable", "peaks", "model", json!(true)),
        ("ContactTable", "damping", "contact", json!(0.3)),
        ("OutputTable", "checkpoint_every", "output", json!(5)),
        ("Joint", "cohesion", "joints.seam", json!(1.0)),
        ("Joint", "tension", "joints.seam", json!(1.0)),
        ("Joint", "dilation", "joints.seam", json!(1.0)),
        ("Joint", "friction", "joints.glued", json!(1.0)),
        ("Joint", "residual_cohesion", "joints.glued", json!(1.0)),
        ("BlockSet", "origin", "blocks.1", json!([4, 0, 0])),
        ("BlockSet", "count", "blocks.1", json!([2, 1, 1])),
        ("BlockSet", "divisions", "blocks.1", json!(2)),
        ("BlockSet", "body", "blocks.1", json!("rigid")),
        ("BlockSet", "axes", "blocks.1", json!([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])),
        ("Remove", "release", "remove.1", json!(0.5)),
        ("Charge", "delay", "charge.0", json!(0.5)),
        ("Initial", "velocity", "initial.0", json!([1, 0, 0])),
        ("Initial", "centre", "initial.0", json!([1, 0, 0])),
        ("Where", "within", "assign.0.where", json!(90)),
        ("RockRegion", "divisions", "region.0", json!(4)),
        ("RockRegion", "join", "region.0", json!(true)),
        ("RockRegion", "body", "region.0", json!("rigid")),
        ("RockRegion", "north", "region.0", json!([1, 0, 0])),
        ("RockRegion", "seed", "region.0", json!(1)),
        ("SmallBlocks", "width", "region.0.small", json!(0.5)),
        ("SmallBlocks", "is", "region.0.small", json!("removed")),
        ("RockCut", "join", "cut.0", json!(true)),
        ("RockCut", "bridge", "cut.1", json!("seam")),
        ("SetCut", "persistence", "cut.0.set", json!(0.5)),
        ("NetworkCut", "least", "cut.2.dfn", json!(1.0)),
        ("VoronoiCut", "least", "cut.3.voronoi", json!(1.0)),
        ("SpacingTable", "least", "cut.0.set.spacing", json!(0.5)),
        ("Stage", "bracket", "stage.2", json!([1, 2])),
        ("Stage", "resolution", "stage.2", json!(0.1)),
        ("Stage", "limit", "stage.2", json!(0.1)),
        ("Stage", "tolerance", "stage.0", json!(1e-4)),
        ("Stage", "tolerance", "stage.2", json!(1e-4)),
        ("Stage", "max_steps", "stage.0", json!(1)),
        ("Stage", "max_steps", "stage.2", json!(1)),
        ("Stage", "increments", "stage.0", json!(2)),
        ("Stage", "on_failure", "stage.0", json!("continue")),
        ("Stage", "on_failure", "stage.1", json!("continue")),
        ("Stage", "damping", "stage.1", json!({ "ratio": 0.1 })),
        ("Stage", "time_step", "stage.1", json!(1e-5)),
        ("Stage", "until_rest", "stage.1", json!(true)),
        ("Stage", "frames", "stage.1", json!(2)),
        ("Probe", "quantity", "probe.0", json!("velocity")),
        ("Probe", "every_steps", "probe.0", json!(2)),
    ]
}

/// `BASE` or `ROCK` with a key, or without it.
fn with(place: &str, key: &str, value: Option<&Value>) -> Deck {
    let rock = ["region", "cut"].iter().any(|section| place.starts_with(section));
    let base = if rock { ROCK } else { BASE };
    let mut root = toml::Value::Table(base.parse::<Table>().unwrap());
    let mut at = &mut root;
    for part in place.split('.').filter(|part| !part.is_empty()) {
        at = match part.parse::<usize>() {
            Ok(index) => &mut at[index],
            Err(_) => at
                .as_table_mut()
                .unwrap()
                .entry(part)
                .or_insert_with(|| toml::Value::Table(Table::new())),
        };
    }
    let table = at.as_table_mut().unwrap();
    // Only cells of a file are joined.
    if place == "region.0" && key == "join" {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/decks/pair.obj");
        table.remove("box");
        table.insert("file".to_owned(), file.to_str().unwrap().into());
        table.insert("joint".to_owned(), "seam".into());
    }
    let removed = table.remove(key);
    match value {
        Some(value) => {
            table.insert(key.to_owned(), toml::Value::try_from(value).unwrap());
            // Parts that stay one block have no joint between them.
            if key == "join" && *value == json!(true) {
                table.remove("joint");
            }
        }
        None => assert!(removed.is_none(), "{place}.{key} is in the deck"),
    }
    let mut deck = from_table(root.as_table().unwrap()).unwrap();
    read_files(&mut deck, Path::new("")).unwrap();
    deck
}

/// Everything that keys with defaults can change: the problem, and the settings of its run.
fn effect(deck: &Deck) -> String {
    if !deck.region.is_empty() {
        let rock = deck.cut_regions().unwrap_or_else(|error| panic!("{error}"));
        return format!(
            "{} {:?}",
            ddem_io::cells::table(&rock, &rock.added_inertia()),
            rock.complex
        );
    }
    let built = BuiltDeck::new(deck).unwrap_or_else(|error| panic!("{error}"));
    let mut problem = (**built.problem()).clone();
    // Without a value the damping is that of the deck.
    let damping = problem.properties.contact.damping_ratio();
    assert_eq!(damping, deck.damping_ratio());
    problem.properties.contact.damping = Some(damping);
    let increments = Simulation::new(built.model()).default_increments();
    let stage = |stage: &Stage| {
        format!(
            "{:?} {} {} {} {:?} {:?} {:?} {} {}",
            stage.search(),
            stage.tolerance(),
            stage.max_steps(),
            stage.increments.unwrap_or(increments),
            stage.on_failure.unwrap_or_default(),
            stage.damping.unwrap_or_default(),
            stage.time_step.unwrap_or_default(),
            stage.until_rest.unwrap_or_default(),
            stage.frames(),
        )
    };
    let stages: Vec<String> = deck.stage.iter().map(stage).collect();
    let probe = |probe: &Probe| format!("{:?} {}", probe.quantity, probe.every_steps());
    let probes: Vec<String> = deck.probe.iter().map(probe).collect();
    let every = deck.output.checkpoint_interval();
    format!("{} {problem:?} {stages:?} {probes:?} {every:?}", deck.title)
}

/// First place where two effects differ.
fn difference(a: &str, b: &str) -> String {
    let equal = a.bytes().zip(b.bytes()).take_while(|(a, b)| a == b).count();
    let near = |text: &str| {
        let bytes = &text.as_bytes()[equal.saturating_sub(60)..(equal + 60).min(text.len())];
        String::from_utf8_lossy(bytes).into_owned()
    };
    format!("{} instead of {}", near(a), near(b))
}

#[test]
fn omitted_keys_have_the_stated_defaults() {
    let places = places();
    for default in defaults().iter().filter(|default| !default.is_rule()) {
        let Default { table, key, .. } = default;
        let Some((value, _)) = default.value() else { continue };
        let own: Vec<_> = places.iter().filter(|(t, k, ..)| t == table && k == key).collect();
        assert!(!own.is_empty(), "add `{key}` of `{table}` to the list of places");
        for (_, _, place, other) in own {
            let omitted = effect(&with(place, key, None));
            let given = effect(&with(place, key, Some(&value)));
            assert!(omitted == given, "{place}.{key}: {}", difference(&omitted, &given));
            let changed = effect(&with(place, key, Some(other)));
            assert!(omitted != changed, "{place}.{key} has no effect");
        }
    }
    let stated = defaults();
    for (table, key, ..) in places {
        assert!(stated.iter().any(|d| d.table == table && d.key == key), "{table}.{key}");
    }
}

#[test]
fn defaults_that_follow_from_other_keys() {
    let stated = |table: &str, key: &str| {
        let all = defaults();
        all.into_iter().find(|d| d.table == table && d.key == key).unwrap().stated
    };
    let of = |text: &str| ddem_deck::parse(text, "deck.toml").unwrap().0;
    let words = "`true` if there are several sets of blocks or a joint that can fail";
    assert_eq!(stated("ModelTable", "contact"), words);
    let set = "[[blocks]]\nmaterial = 'rock'\njoint = 'seam'\n";
    let joint = "[joints.seam]\nthickness = 0.1\n";
    assert!(!of(&format!("{set}{joint}")).finds_contacts());
    assert!(of(&format!("{set}{joint}tension = 1")).finds_contacts());
    assert!(of(&format!("{set}{set}{joint}")).finds_contacts());

    assert_eq!(stated("Joint", "residual_friction"), "`friction`");
    let [omitted, given] = [None, Some(json!(30))]
        .map(|value| effect(&with("joints.seam", "residual_friction", value.as_ref())));
    assert!(omitted == given, "{}", difference(&omitted, &given));

    assert_eq!(stated("Charge", "history"), "`\"gas\"` with `mass`, constant with `pressure`");
    let expands =
        |key: &str| of(&format!("[[charge]]\nwhere = {{}}\n{key} = 1")).charge[0].expands();
    assert!(expands("mass") && !expands("pressure"));

    assert_eq!(stated("Probe", "every"), "a thousandth of the stage");
    assert_eq!(Probe::SAMPLES, 1000);
}

#[test]
fn only_the_schema_has_numbers_for_omitted_keys() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut paths = Vec::new();
    for folder in ["ddem-deck/src", "ddem-io/src", "ddem-py/src"] {
        crate::notation::sources(&root.join(folder), &mut paths);
    }
    for path in paths {
        let source = std::fs::read_to_string(&path).unwrap();
        for default in defaults().iter().filter(|default| default.value().is_some()) {
            let own = [".unwrap_or(", ".map_or("].map(|or| format!(".{}{or}", default.key));
            let given = own.iter().flat_map(|own| source.split(own.as_str()).skip(1));
            let literal = |after: &str| after.starts_with(|c: char| c.is_ascii_digit() || c == '[');
            assert!(!given.into_iter().any(literal), "{}: {own:?}", path.display());
        }
    }
}
