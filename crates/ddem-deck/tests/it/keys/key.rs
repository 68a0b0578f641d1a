//! A key of a table, in documentation, docstrings and stubs.

use std::fmt::Write;

use serde_json::Value;

use super::json_schema;
use crate::python;

/// Keys of `where` that select the cells of a cut, whose own keys `plane` and `set` are its shapes.
const CELLS: [&str; 8] = ["x", "y", "z", "sphere", "cylinder", "above", "below", "inside"];

/// Key of a table, from its description in the schema.
#[derive(Clone)]
pub(super) struct DeckKey {
    pub(super) name: String,
    meaning: String,
    unit: Option<String>,
    /// Text after "default", or "–" with the condition under which the key is needed.
    default: String,
    schema: Value,
    pub(super) optional: bool,
}

impl DeckKey {
    /// Splits "Meaning `[unit]`; default value." or "…; needed if … .".
    pub(super) fn new(name: &str, schema: &Value, required: bool) -> Self {
        let text =
            schema["description"].as_str().unwrap_or_else(|| panic!("`{name}` says nothing"));
        let text = text.replace('\n', " ");
        let text = text.strip_suffix('.').unwrap_or_else(|| panic!("`{name}`: {text}"));
        let (text, default) = match (text.rsplit_once("; default "), text.rsplit_once("; needed")) {
            (Some((text, default)), _) => (text, default.to_owned()),
            (None, Some((text, case))) => (text, format!("–{case}")),
            (None, None) if required => (text, "–".to_owned()),
            (None, None) => panic!("`{name}` has neither a default nor a condition: {text}"),
        };
        let unit = text.strip_suffix("]`").and_then(|text| text.rsplit_once(" `["));
        let (meaning, unit) = unit.map_or((text, None), |(text, unit)| (text, Some(unit.into())));
        let (name, meaning) = (name.to_owned(), meaning.to_owned());
        let optional = !required && default != "–";
        Self { name, meaning, unit, default, schema: schema.clone(), optional }
    }

    /// The key in a stage of one kind, without the kinds that have it. `None` if that kind does
    /// not have it.
    pub(super) fn of_kind(self, kind: &str) -> Option<Self> {
        let stages = serde_json::from_value(kind.into()).unwrap();
        if !ddem_deck::stage_keys(stages).contains(&self.name.as_str()) {
            return None;
        }
        let (_, meaning) = self.meaning.split_once(": ")?;
        let needed = self.default == format!("– in {kind} stages");
        let ends = if kind == "safety" { "a trial" } else { "the stage" };
        let meaning = meaning.replace("the stage, or a trial,", ends);
        let mut letters = meaning.chars();
        let first = letters.next()?.to_uppercase();
        Some(Self {
            meaning: first.chain(letters).collect(),
            default: if needed { "–".to_owned() } else { self.default },
            optional: self.optional && !needed,
            ..self
        })
    }

    /// Row of a table in the documentation.
    pub(super) fn row(&self, prefix: &str) -> String {
        let Self { name, meaning, unit, default, .. } = self;
        let unit = unit.as_deref().unwrap_or_default();
        format!("| `{prefix}{name}` | {meaning} | {unit} | {default} |")
    }

    /// Row of a table of words.
    pub(super) fn row_of_word(&self) -> String {
        format!(
            "| `{}` | {} | {} |",
            self.name,
            self.meaning,
            self.unit.as_deref().unwrap_or_default()
        )
    }

    fn python_name(&self) -> &str {
        python::argument(&self.name)
    }

    /// Parameter of a docstring.
    pub(super) fn parameter(&self) -> String {
        let Self { meaning, unit, default, .. } = self;
        let unit = unit.as_ref().map_or_else(String::new, |unit| format!(" [{unit}]"));
        let default = match default.strip_prefix('–') {
            None if default == "none" => String::new(),
            None => format!("; default {default}"),
            Some("") => String::new(),
            Some(case) => format!("; needed{case}"),
        };
        let optional = if self.optional { ", optional" } else { "" };
        let text = in_python(&format!("{meaning}{unit}{default}."));
        let head = if self.name == "where" {
            format!("{} : optional", self.where_keys().join(", "))
        } else {
            format!("{} : {}{optional}", self.python_name(), self.words())
        };
        format!("{head}\n{}", wrapped(&text))
    }

    /// Keys of `where` that are arguments of their own: those of cells for the cells of a cut.
    fn where_keys(&self) -> Vec<&'static str> {
        let of_cells = |key: &&str| !self.meaning.starts_with("Cells") || CELLS.contains(key);
        ddem_deck::keys("Where").into_iter().filter(of_cells).collect()
    }

    /// Type in a docstring.
    fn words(&self) -> String {
        match self.python_type().as_str() {
            "Vector" => match self.schema["minItems"].as_u64() {
                Some(n) if n <= 3 => format!("({})", vec!["float"; n as usize].join(", ")),
                _ => "array of float".to_owned(),
            },
            "Sequence[int]" => "array of int".to_owned(),
            "Sequence[Vector]" => "array of vectors".to_owned(),
            "Sequence[Sequence[Vector]]" => "list of arrays of vectors".to_owned(),
            "Sequence[str]" => "list of str".to_owned(),
            "History" => "callable, dict or rows".to_owned(),
            "Damping" => "float, str or dict".to_owned(),
            "Extent" => "float or (float, float)".to_owned(),
            "Sphere" | "Cylinder" | "Plane" => "dict".to_owned(),
            "Sheet" => "float or dict".to_owned(),
            "Path" => "path".to_owned(),
            name if name.starts_with("Literal[\"gas\"]") => {
                "\"gas\", callable, dict or rows".to_owned()
            }
            name if name.starts_with("Literal[") => {
                format!("{{{}}}", &name["Literal[".len()..name.len() - 1])
            }
            "Mapping[str, Any] | Sequence[Vector]" => "dict or two corners".to_owned(),
            name if name.starts_with("Mapping") => "dict".to_owned(),
            "str | Joint | Mapping[str, str | Joint]" => "Joint, str or dict".to_owned(),
            "str | Mapping[str, float]" => "str or dict".to_owned(),
            name => {
                name.replace("str | ", "str or ").replace(" | Literal[\"auto\"]", " or \"auto\"")
            }
        }
    }

    /// Type in a stub.
    pub(super) fn python_type(&self) -> String {
        match self.name.as_str() {
            "inside" | "topography" | "surface" => return "Path".to_owned(),
            "bridge" => return "str | Joint".to_owned(),
            "faces" => return "Sequence[Sequence[Vector]]".to_owned(),
            "material" => return "str | Material".to_owned(),
            "joint" if reference(&self.schema) != Some("JointChoice") => {
                return "str | Joint".to_owned();
            }
            _ => {}
        }
        if let Some(name) = reference(&self.schema) {
            return named(name);
        }
        let kind = |schema: &Value| {
            let kinds = &schema["type"];
            let kind = kinds.as_str().or_else(|| kinds[0].as_str());
            kind.unwrap_or_else(|| panic!("{schema}")).to_owned()
        };
        match kind(&self.schema).as_str() {
            "number" => "float".to_owned(),
            "integer" => "int".to_owned(),
            "boolean" => "bool".to_owned(),
            "string" => "str".to_owned(),
            _ => {
                let items = &self.schema["items"];
                let inner =
                    if reference(items).is_some() { "string".to_owned() } else { kind(items) };
                match inner.as_str() {
                    "number" => "Vector",
                    "integer" => "Sequence[int]",
                    "array" => "Sequence[Vector]",
                    _ => "Sequence[str]",
                }
                .to_owned()
            }
        }
    }

    /// Entry of a typed dictionary.
    pub(super) fn entry(&self) -> String {
        format!("{}: {}", self.python_name(), self.python_type())
    }

    /// Attribute in a stub.
    pub(super) fn attribute(&self) -> String {
        let kind = self.python_type().replace("Vector", "list[float]");
        let none = if self.is_nullable() { " | None" } else { "" };
        format!("{}: Final[{kind}{none}]", self.python_name())
    }

    fn is_nullable(&self) -> bool {
        self.schema["type"].as_array().is_some() || self.schema["anyOf"].is_array()
    }

    /// Argument in a stub.
    pub(super) fn argument(&self) -> String {
        let (name, kind) = (self.python_name(), self.python_type());
        if !self.optional {
            let default = if self.default == "–" { "" } else { " | None = None" };
            return format!("{name}: {kind}{default},");
        }
        match &self.schema["default"] {
            _ if self.is_nullable() => format!("{name}: {kind} | None = None,"),
            Value::String(text) => format!("{name}: {kind} = \"{text}\","),
            Value::Number(number) => format!("{name}: {kind} = {number},"),
            _ if kind == "bool" => format!("{name}: {kind} = False,"),
            Value::Array(_) if kind == "Sequence[Vector]" => {
                format!("{name}: {kind} | None = None,")
            }
            _ => format!("{name}: {kind} = ...,"),
        }
    }
}

/// Name of the definition that a schema refers to.
fn reference(schema: &Value) -> Option<&str> {
    let target = schema["$ref"].as_str().or_else(|| schema["anyOf"][0]["$ref"].as_str())?;
    target.rsplit('/').next()
}

/// Type of a definition in a stub.
fn named(name: &str) -> String {
    match name {
        "History" | "Damping" | "Extent" | "Sphere" | "Cylinder" | "Plane" | "Sheet" | "Where" => {
            name.to_owned()
        }
        "ChargeHistory" => "Literal[\"gas\"] | History".to_owned(),
        "TimeStep" => "float | Literal[\"auto\"]".to_owned(),
        "Explosive" => "str | Mapping[str, float]".to_owned(),
        "Edges" | "Gradient" => "Mapping[str, Vector]".to_owned(),
        "BoxShape" => "Mapping[str, Any] | Sequence[Vector]".to_owned(),
        "BlockMesh" | "PrismShape" | "SmallBlocks" | "SetCut" | "PlaneCut" | "DiscCut"
        | "NetworkCut" | "TunnelCut" | "VoronoiCut" => "Mapping[str, Any]".to_owned(),
        "Orientations" => "Mapping[str, Mapping[str, float]]".to_owned(),
        "JointChoice" => "str | Joint | Mapping[str, str | Joint]".to_owned(),
        name => {
            let schema = json_schema();
            let definition = &schema["$defs"][name];
            let listed = definition["enum"].as_array().into_iter().flatten();
            let one_of = definition["oneOf"].as_array().into_iter().flatten();
            let words = listed.chain(one_of.map(|one| &one["const"]));
            let words: Vec<String> = words.map(|word| format!("{word}")).collect();
            assert!(!words.is_empty(), "{name}: {definition}");
            format!("Literal[{}]", words.join(", "))
        }
    }
}

/// Text in which tables without values are dictionaries: `{a, b}` is `{"a": ..., "b": ...}`.
fn named_entries(text: &str) -> String {
    let parts = text.split('`').enumerate().map(|(i, part)| {
        let names = part.strip_prefix('{').and_then(|part| part.strip_suffix('}'));
        let is_name = |name: &str| name.chars().all(|c| c.is_ascii_lowercase() || c == '_');
        match names.map(|names| names.split(", ").collect::<Vec<_>>()) {
            Some(names) if i % 2 == 1 && names.iter().all(|name| is_name(name)) => {
                let entries = names.iter().map(|name| format!("\"{name}\": ..."));
                format!("{{{}}}", entries.collect::<Vec<_>>().join(", "))
            }
            _ => part.to_owned(),
        }
    });
    parts.collect::<Vec<_>>().join("`")
}

/// Text about a deck in the notation of docstrings.
fn in_python(text: &str) -> String {
    let text = text.replace("`\"none\"`, or one of", "`\"none\"`, a damping ratio, or one of");
    let parts = named_entries(&python::text(&text));
    let parts = parts.split('`').enumerate().map(|(i, part)| {
        // In braces a single pair of backticks is a link.
        if i % 2 == 1 && part.starts_with('{') { format!("`{part}`") } else { part.to_owned() }
    });
    parts.collect::<Vec<_>>().join("`")
}

/// Paragraph of a docstring, indented.
fn wrapped(text: &str) -> String {
    let mut lines = vec![String::from("   ")];
    for word in text.split(' ') {
        let last = lines.len() - 1;
        if lines[last].chars().count() + 1 + word.chars().count() > 100 {
            lines.push(String::from("   "));
        }
        let last = lines.len() - 1;
        write!(lines[last], " {word}").unwrap();
    }
    lines.join("\n")
}
