//! Decks that the schema generates: each is read, and built or refused, without a panic, in bounded time.

use std::cell::Cell;

use ddem_deck::json_schema;
use serde_json::Value as Form;
use toml::{Table, Value};

use crate::fuzz::{Choices, ROCK, try_all, use_deck};

/// Models to which sections are added, so that many of the decks can be built.
const BASES: [&str; 2] = [
    "[[blocks]]\nname = 'set'\nsize = [4, 4, 4]\ncount = [2, 2, 2]\nmaterial = 'rock'\njoint = 'seam'\ndivisions = 1\n",
    "[[region]]\nname = 'set'\nbox = { from = [0, 0, 0], to = [4, 4, 4] }\nmaterial = 'rock'\njoint = 'seam'\n\
     [[cut]]\nname = 'cut'\njoint = 'seam'\nset = { dip = 30, dip_direction = 40, spacing = 3 }\n",
];
const REST: &str = "
[[fix]]
where = { z = 0.0 }
axes = 'xyz'
[[stage]]
name = 'first'
kind = 'relax'
[[stage]]
name = 'last'
kind = 'dynamic'
duration = 0.1
";

/// Grammar of decks: their JSON schema.
struct Grammar {
    schema: Form,
}

impl Grammar {
    /// A value of a form, as the value of a key.
    fn value(&self, choices: &mut Choices, form: &Form, key: &str) -> Value {
        if let Some(name) = form["$ref"].as_str() {
            let name = name.rsplit('/').next().unwrap();
            return self.value(choices, &self.schema["$defs"][name], key);
        }
        if let Some(forms) = form["anyOf"].as_array().or(form["oneOf"].as_array()) {
            let forms: Vec<&Form> = forms.iter().filter(|form| form["type"] != "null").collect();
            let form = *choices.one(&forms);
            return self.value(choices, form, key);
        }
        if let Some(word) = form["const"].as_str() {
            return Value::String(word.to_owned());
        }
        let kinds =
            form["type"].as_array().map_or(std::slice::from_ref(&form["type"]), Vec::as_slice);
        match kinds.iter().find(|kind| *kind != "null").and_then(Form::as_str) {
            Some("object") => Value::Table(self.table(choices, form)),
            Some("array") => {
                let least = form["minItems"].as_u64().unwrap_or(0) as usize;
                let most = form["maxItems"].as_u64().map_or(least + 3, |most| most as usize);
                let n = least + choices.below(most - least + 1);
                Value::Array((0..n).map(|_| self.value(choices, &form["items"], key)).collect())
            }
            Some("integer") => {
                let least = form["minimum"].as_f64().unwrap_or(0.0) as i64;
                Value::Integer(*choices.one(&[least, 1, 2, 4, 1000]))
            }
            Some("boolean") => Value::Boolean(choices.below(2) == 0),
            Some("string") => Value::String(choices.name(key).to_owned()),
            Some("number") => Value::Float(
                *choices.one(&[-1.0, 0.0, 1e-3, 0.25, 0.5, 1.0, 2.0, 4.0, 30.0, 90.0, 1e5, 1e9]),
            ),
            _ => panic!("the form {form} of `{key}` is not known here"),
        }
    }

    /// A table with all keys that it needs, and some others.
    fn table(&self, choices: &mut Choices, form: &Form) -> Table {
        let needed: Vec<_> = form["required"].as_array().into_iter().flatten().collect();
        let mut table = Table::new();
        for (key, form) in form["properties"].as_object().into_iter().flatten() {
            if needed.iter().any(|needed| *needed == key) || choices.below(4) == 0 {
                table.insert(key.clone(), self.value(choices, form, key));
            }
        }
        if form["additionalProperties"].is_object() {
            let name = *choices.one(&["rock", "seam", "other"]);
            table.insert(name.to_owned(), self.value(choices, &form["additionalProperties"], name));
        }
        table
    }

    /// Adds sections to a deck.
    fn add_sections(&self, choices: &mut Choices, deck: &mut Table) {
        let sections = self.schema["properties"].as_object().unwrap();
        for (key, form) in sections {
            if choices.below(8) > 0 {
                continue;
            }
            match (deck.get_mut(key), self.value(choices, form, key)) {
                (Some(Value::Array(own)), Value::Array(more)) => own.extend(more),
                (Some(Value::Table(own)), Value::Table(more)) => own.extend(more),
                (_, value) => drop(deck.insert(key.clone(), value)),
            }
        }
    }
}

impl Choices {
    /// A name that a key may refer to.
    fn name(&mut self, key: &str) -> &'static str {
        let names: &[&'static str] = match key {
            "material" => &["rock", "rock", "other"],
            "joint" | "joints" | "bridge" => &["seam", "seam", "other"],
            "axes" => &["x", "xyz", "zy"],
            _ => &["first", "last", "set", "cut", "new", "none.csv"],
        };
        names[self.below(names.len())]
    }
}

#[test]
fn generated_decks_never_panic() {
    let grammar = Grammar { schema: json_schema() };
    let bases = BASES.map(|base| format!("{base}{ROCK}{REST}").parse::<Table>().unwrap());
    let built = Cell::new(0);
    let tries = try_all(|seed, text| {
        let mut choices = Choices(seed);
        let mut table = choices.one(&bases).clone();
        grammar.add_sections(&mut choices, &mut table);
        *text = table.to_string();
        // The reader takes what the schema allows.
        let (deck, _) = ddem_deck::parse_alone(text, "deck.toml").unwrap();
        built.set(built.get() + u64::from(use_deck(&deck)));
    });
    println!("{} of {tries} are built", built.get());
    assert!(built.get() > tries / 20, "few of the decks are valid");
}
