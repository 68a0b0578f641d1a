//! A good deck is read, written and read back equal; no text stops the program.

use ddem_deck::{Damping, Extent, History, JointChoice, TimeStep};
use ddem_deck::{json_schema, parse, write};

use super::{GOOD, judge, report};

#[test]
fn every_key_is_read() {
    let (deck, source) = parse(GOOD, "good.toml").unwrap();
    source.check(&deck).unwrap();
    assert_eq!(deck.materials["rock"].density, 2400.0);
    assert_eq!(deck.materials["soft rock"].poisson, 0.3);
    assert_eq!(deck.blocks[0].joint, Some(JointChoice::All("seam".into())));
    let by_normal = JointChoice::ByNormal { x: Some("spring".into()), y: None, z: None };
    assert_eq!(deck.blocks[1].joint, Some(by_normal));
    assert_eq!(deck.assign[0].r#where.z, Some(Extent::Range([1.9, 2.1])));
    assert_eq!(deck.fix[1].r#where.x, Some(Extent::Plane(12.0)));
    assert_eq!(deck.fix[1].history, Some(History::Table(vec![[0.0, 0.0], [0.01, 1.0]])));
    assert_eq!(deck.load[0].history, Some(History::Ramp(0.01)));
    assert_eq!(deck.stage[1].damping, Some(Damping::Ratio(0.05)));
    assert_eq!(deck.stage[1].time_step, Some(TimeStep::Auto));
    assert_eq!(deck.stage[2].damping, Some(Damping::None));
    assert_eq!(deck.stage[2].time_step, Some(TimeStep::Seconds(1e-5)));
    assert_eq!(deck.stage[2].duration, Some(1.0));
    assert_eq!((deck.contact.friction, deck.contact.restitution), (Some(25.0), None));
}

#[test]
fn written_decks_read_back_equal() {
    let (deck, _) = parse(GOOD, "good.toml").unwrap();
    let text = write(&deck).unwrap();
    let (again, source) = parse(&text, "written.toml").unwrap();
    assert_eq!(again, deck);
    source.check(&again).unwrap();
    insta::assert_snapshot!(text);
    let (empty, _) = parse("", "empty.toml").unwrap();
    assert_eq!(parse(&write(&empty).unwrap(), "written.toml").unwrap().0, empty);
    // The reader of the `toml` library accepts the same deck.
    assert_eq!(toml::from_str::<ddem_deck::Deck>(GOOD).unwrap(), deck);
    let json = serde_json::to_value(&deck).unwrap();
    assert_eq!(serde_json::from_value::<ddem_deck::Deck>(json).unwrap(), deck);
}

#[test]
fn fault_places_are_located_in_the_text() {
    let (_, source) = parse(GOOD, "good.toml").unwrap();
    for (place, text) in [
        ("materials.rock.young", "18e9"),
        ("materials.\"soft rock\".young", "2e9"),
        ("materials.\"soft rock\"", "[materials.\"soft rock\"]"),
        ("model.gravity[2]", "-9.81"),
        ("blocks[1]", "[[blocks]]"),
        ("blocks[0].count", "[12, 3, 3]"),
        ("blocks[0].axes[1][1]", "1"),
        ("blocks[1].edges.x[2]", "2.5"),
        ("blocks[1].joint.x", "\"spring\""),
        ("remove[0].where.sphere.radius", "0.2"),
        ("fix[1].where.x", "12.0"),
        ("stage[1].damping.ratio", "0.05"),
        // If a place does not exist, the nearest table around it is found.
        ("joints.spring.density", "[joints.spring]"),
        ("remove[0].where.sphere.colour", "{ centre = [1.2, 1.2, 1.2], radius = 0.2 }"),
        ("blocks[1].count[0]", "[[blocks]]"),
        ("refine[0]", ""),
        ("", ""),
        ("]].\"[x", ""),
    ] {
        assert_eq!(&source.text()[source.locate(place)], text, "{place}");
    }
    // The second header, not the first.
    assert_eq!(source.locate("blocks[1]").start, GOOD.rfind("[[blocks]]").unwrap());
}

#[test]
fn dotted_keys_are_located() {
    let text =
        "materials.rock.density = 1\nmaterials.rock.young = -3.0\nmaterials.rock.poisson = 0\n";
    let (deck, source) = parse(text, "dotted.toml").unwrap();
    assert_eq!(&text[source.locate("materials.rock.young")], "-3.0");
    let error = source.check(&deck).unwrap_err();
    let young = error.findings().iter().find(|f| f.fault.place == "materials.rock.young").unwrap();
    assert_eq!((young.line, young.column), (2, 24));
}

/// Every number of the good deck is checked: none may be NaN or infinite.
#[test]
fn infinite_and_nan_numbers_are_refused() {
    let mut changed = 0;
    for (start, end) in floats(GOOD) {
        for value in ["nan", "inf", "-inf"] {
            let text = format!("{}{value}{}", &GOOD[..start], &GOOD[end..]);
            let (deck, source) = parse(&text, "deck.toml").unwrap_or_else(|e| panic!("{e}"));
            let error = source.check(&deck).expect_err(&text[start - 20..]);
            let here = |f: &&ddem_deck::Finding| f.span == (start..start + value.len());
            let finding = error.findings().iter().find(here).unwrap_or_else(|| panic!("{error}"));
            assert!(finding.fault.message.contains("finite"), "{}", finding.fault);
            changed += 1;
        }
    }
    assert!(changed > 150, "{changed}");
}

/// Byte ranges of the numbers in a deck, except keys that take whole numbers.
fn floats(text: &str) -> Vec<(usize, usize)> {
    let whole = ["count", "divisions", "max_steps", "increments", "frames", "every_steps"];
    let mut floats = Vec::new();
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        if let Some((key, _)) = line.split_once(" = ")
            && !whole.contains(&key)
            && !line.contains('"')
        {
            let part = |c: char| c.is_ascii_digit() || "+-.e".contains(c);
            let mut start = key.len();
            while let Some(from) = line[start..].find(|c: char| c.is_ascii_digit() || c == '-') {
                let from = start + from;
                let to = line[from..].find(|c| !part(c)).map_or(line.len(), |to| from + to);
                floats.push((at + from, at + to));
                start = to;
            }
        }
        at += line.len();
    }
    floats
}

/// Any cut or insertion in a deck gives a deck or an error.
#[test]
fn arbitrary_text_never_panics() {
    let boundary = |at: &usize| GOOD.is_char_boundary(*at);
    for at in (0..GOOD.len()).filter(boundary) {
        report(&GOOD[..at]);
        report(&GOOD[at..]);
        for put in ["[", "]", "\"", "{", "}", "=", ".", "-", "\n", "nan", "[[", "0", "\u{0}", "é"]
        {
            let cut = if at % 2 == 0 { at } else { at + 1 };
            if boundary(&cut) {
                judge(&format!("{}{put}{}", &GOOD[..at], &GOOD[cut..]));
            }
        }
    }
    report(&"[".repeat(10_000));
    report(&format!("a = {}", "{ a = ".repeat(10_000)));
    report(&"a.".repeat(10_000));
    report("\u{feff}title = 1\r\n");
}

#[test]
fn schema_lists_every_form() {
    let schema = json_schema();
    let properties = schema["properties"].as_object().unwrap();
    assert_eq!(properties.len(), 21);
    assert_eq!(schema["additionalProperties"], false);
    let forms = &schema["$defs"]["TimeStep"]["anyOf"];
    assert_eq!(forms[0]["const"], "auto");
    assert_eq!(forms[1]["type"], "number");
    assert_eq!(schema["$defs"]["Extent"]["anyOf"].as_array().unwrap().len(), 2);
    let by_normal = &schema["$defs"]["JointChoice"]["anyOf"][1];
    assert_eq!(by_normal["additionalProperties"], false);
    insta::assert_snapshot!(serde_json::to_string_pretty(&schema).unwrap());
}
