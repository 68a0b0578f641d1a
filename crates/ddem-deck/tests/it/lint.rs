//! Rules of diagnostics: their codes, their page, and how a deck silences one.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use ddem_core::ErrorCode;
use ddem_deck::lint::Code;
use ddem_deck::*;

use crate::coverage;
use crate::decks::*;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Text of `docs/diagnostics.md`.
fn page() -> String {
    let mut page = "# Diagnostics\n\n\
        Every error and every warning has a stable code: new versions may add codes, but rename none.\n\n\
        ## Warnings\n\n\
        A warning is about a setting or a result that is allowed but perhaps not meant. The command line, Python and\n\
        `summary.json` show it alike: the key of the deck, the finding, advice and the code of the rule.\n\n\
        ```\n\
        warning: joints.seam.friction: `friction` is an angle of only 0.6 degrees; a coefficient of 0.6 is 31.0 degrees, 0.6 rad are 34.4 [suspicious-unit]\n\
        ```\n\n\
        A deck silences a rule by its code:\n\n\
        ```toml\n[lint]\nallow = [\"suspicious-unit\"]\n```\n\n\
        Python issues each warning as a `UserWarning` that names methods and arguments. `summary.json` has `code`, `severity`,\n\
        `place`, `message` and `help` in its list `warnings`, each warning once; `ddem info DIR` prints them.\n\n"
        .to_owned();
    let warnings = Code::ALL.iter().map(|code| (code.name(), code.meaning()));
    table(&mut page, warnings);
    page += "\n## Errors\n\n\
        An error ends the run. The command line shows the line of the deck and underlines what is wrong; exit status 2 means\n\
        that nothing has run, 1 that the run failed. In Python the exceptions under `ddem.Error` have the attribute `code`, and\n\
        each of `ddem.ModelError.faults` has its own. In Rust `Fault`, `ModelError`, `DeckError`, `BuildError`,\n\
        `RunError`, `RestoreError`, `RunFailure`, `FolderError` and `OutputError` have it. Wrong arguments of a call in Python,\n\
        and functions that draw, raise the usual `TypeError`, `ValueError` or `KeyError` without a code.\n\n\
        ```\n\
        deck.toml:10:1: materials.rock.denisty: unknown key `denisty` (did you mean `density`? keys here: `density`, `young`, `poisson`) [unknown-key]\n\
        ```\n\n";
    table(&mut page, ErrorCode::ALL.iter().map(|code| (code.name(), code.meaning())));
    page
}

fn table(page: &mut String, codes: impl Iterator<Item = (&'static str, &'static str)>) {
    *page += "| Code | Issued when |\n|---|---|\n";
    for (name, meaning) in codes {
        writeln!(page, "| `{name}` | {} |", meaning.trim_end_matches('.')).unwrap();
    }
}

/// Compares the page; `DDEM_DOCS=1 cargo test -p ddem-deck --test it lint` writes it.
#[test]
fn lint_page_lists_all_rules() {
    let path = root().join("docs/diagnostics.md");
    if std::env::var_os("DDEM_DOCS").is_some() {
        std::fs::write(&path, page()).unwrap();
    }
    assert_eq!(std::fs::read_to_string(path).unwrap(), page());
}

#[test]
fn every_code_has_an_answer() {
    let answers = std::fs::read_to_string(root().join("docs/questions.md")).unwrap();
    let warnings = Code::ALL.iter().map(|code| code.name());
    for code in warnings.chain(ErrorCode::ALL.iter().map(|code| code.name())) {
        let link = format!("[`{code}`](diagnostics.md#{code})");
        assert!(answers.contains(&link), "docs/questions.md has no answer for {code}");
    }
}

#[test]
fn codes_are_sorted_words() {
    let names: Vec<&str> = Code::ALL.iter().map(|code| code.name()).collect();
    assert!(names.is_sorted(), "{names:?}");
    for code in Code::ALL {
        assert_eq!(toml::Value::try_from(code).unwrap().as_str(), Some(code.name()));
    }
    let errors: Vec<&str> = ErrorCode::ALL.iter().map(|code| code.name()).collect();
    assert!(errors.is_sorted(), "{errors:?}");
    assert!(!errors.iter().any(|name| names.contains(name)));
}

/// Codes that only the Python module uses, so that its tests show them.
const OF_PYTHON: [&str; 3] = ["busy", "not-in-equilibrium", "waiting-stages"];

#[test]
fn every_code_is_in_a_snapshot() {
    let crates = root().join("crates");
    let mut snapshots = Vec::new();
    coverage::snapshots(&crates, &mut snapshots);
    let shows = |name: &str| snapshots.iter().any(|text| text.contains(&format!("[{name}]")));
    let errors = ErrorCode::ALL.iter().map(|code| code.name());
    let warnings = Code::ALL.iter().map(|code| code.name());
    let missing: Vec<&str> = errors.chain(warnings).filter(|name| !shows(name)).collect();
    assert_eq!(missing, OF_PYTHON);
    let mut tests = String::new();
    for entry in std::fs::read_dir(crates.join("ddem-py/tests")).unwrap() {
        // Folders have no text.
        tests += &std::fs::read_to_string(entry.unwrap().path()).unwrap_or_default();
    }
    // Regular expressions have a backslash there.
    let shows =
        |name: &&str| ["]", r"\]"].iter().any(|end| tests.contains(&format!("[{name}{end}")));
    let missing: Vec<&str> = OF_PYTHON.into_iter().filter(|name| !shows(name)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn deck_can_silence_a_rule() {
    let mut deck = deck([2, 1, 1], [2.0, 1.0, 1.0], 1, 0.01);
    deck.model.gravity = [0.0, 0.0, 9.81];
    let codes = |deck: &Deck| {
        let built = BuiltDeck::new(deck).unwrap();
        let warnings = built.warnings(&built.model());
        warnings.iter().map(|warning| warning.code).collect::<Vec<_>>()
    };
    assert_eq!(codes(&deck), [Code::UpwardGravity, Code::NoSupport]);
    deck.lint.allow = vec![Code::UpwardGravity];
    assert_eq!(codes(&deck), [Code::NoSupport]);
    let text = write(&deck).unwrap();
    assert!(text.contains("allow = [\"upward-gravity\"]"), "{text}");
    assert_eq!(parse(&text, "deck.toml").unwrap().0, deck);
    let error = crate::judge("[lint]\nallow = ['upward-gravty']").unwrap().to_string();
    assert!(
        error.contains("found \"upward-gravty\" (did you mean `\"upward-gravity\"`? docs/"),
        "{error}"
    );
}

/// Deck of 3 x 3 x 3 blocks on a fixed base, with some texts replaced and more text at the end.
pub(crate) fn text(changes: &[(&str, &str)], more: &str) -> String {
    let mut text = "
        [model]
        gravity = [0, 0, -10]
        [materials.rock]
        density = 2400
        young = 18e9
        poisson = 0.25
        [joints.seam]
        normal_stiffness = 1e10
        shear_stiffness = 1e10
        friction = 35
        cohesion = 1e5
        [[blocks]]
        name = 'rock'
        size = [3, 3, 3]
        count = [3, 3, 3]
        divisions = 1
        material = 'rock'
        joint = 'seam'
        [[fix]]
        where = { z = 0.0 }
        axes = 'xyz'
        "
    .to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    text + more
}

/// A small set beside the block.
const BESIDE: &str = "
    [[blocks]]
    name = 'beside'
    origin = [3, 0, 0]
    size = [1, 1, 1]
    material = 'rock'
    ";
/// A hole in the middle with a charge in it.
const BLAST: &str = "
    [[remove]]
    where = { set = 'rock', x = [1, 2], y = [1, 2], z = [1, 2] }
    [[charge]]
    where = { sphere = { centre = [1.5, 1.5, 1.5], radius = 0.7 } }
    mass = 500
    explosive = 'tnt'
    ";
/// Place of the charge, a region that reaches through the top, and a borehole.
const BALL: &str = "{ sphere = { centre = [1.5, 1.5, 1.5], radius = 0.7 } }";
const AROUND: &str = "{ x = [0.9, 2.1], y = [0.9, 2.1], z = [0.9, 3.1] }";
const LINE: &str = "{ cylinder = { from = [1.5, 1.5, 0], to = [1.5, 1.5, 3], radius = 0.2 } }";
const RELAX: &str = "[[stage]]\nname = 'weight'\nkind = 'relax'\n";
const DYNAMIC: &str = "[[stage]]\nname = 'go'\nkind = 'dynamic'\nduration = 1e-3\n";

/// Decks that break the rules.
fn broken() -> Vec<String> {
    let deck = |more: &str| text(&[], more);
    let blast = |from: &str, to: &str| text(&[], &BLAST.replace(from, to));
    let (hole, charge) = BLAST.split_once("[[charge]]").unwrap();
    let removed = "[[remove]]\nfrom = 'go'\nrelease = 1\nwhere = { z = [2, 3] }\n";
    let still = RELAX.replace("weight", "go");
    vec![
        text(&[("-10]", "10]")], ""),
        text(&[("[[fix]]\n        where = { z = 0.0 }\n        axes = 'xyz'", "")], ""),
        text(&[("friction = 35", "friction = 0.7")], ""),
        text(&[("friction = 35", "friction = 35\ntension = 1e6")], ""),
        text(&[("friction = 35", "friction = 35\nresidual_friction = 30\ndilation = 32")], ""),
        text(&[("where = { z = 0.0 }", "where = { z = [0, 1] }")], ""),
        deck("[[load]]\nwhere = { z = 3.0 }\npressure = 1e6\nhistory = { ramp = 1 }\n") + RELAX,
        deck(RELAX) + "[[stage]]\nname = 'fs'\nkind = 'safety'\ntolerance = 1e-3\n",
        deck(&(DYNAMIC.to_owned() + "damping = { ratio = 5 }\n")),
        deck("[contact]\nrestitution = 0.01\n"),
        deck("[contact]\nnormal_stiffness = 1e18\n"),
        deck("[contact]\nnormal_stiffness = 1e5\n"),
        text(&[("gravity = [0, 0, -10]", "contact = false")], "[contact]\nfriction = 20\n"),
        text(&[("gravity = [0, 0, -10]", "contact = false")], BESIDE),
        deck(BESIDE),
        deck(&BESIDE.replace("[3, 0, 0]", "[3.01, 0, 0]")),
        text(
            &[("cohesion = 1e5", "cohesion = 1e5\nthickness = 0.02")],
            &(BESIDE.replace("[3, 0, 0]", "[3.005, 0, 0]") + "joint = 'seam'\n"),
        ),
        deck(&(BESIDE.to_owned() + "[[remove]]\nwhere = { set = 'beside' }\n")),
        deck(
            &(BESIDE.replace("1, 1, 1", "1, 0.5, 1")
                + "joint = 'seam'\n[[load]]\nwhere = { x = 3.0 }\npressure = 1e6\n"),
        ),
        deck(
            &(BESIDE.replace("1, 1, 1", "1, 0.5, 2")
                + "joint = 'seam'\n[[load]]\nwhere = { x = 3.0 }\npressure = 1e6\n"),
        ),
        deck("[[initial]]\nstress = [-1e6, -1e6, 1e6, 0, 0, 0]\n"),
        deck(&format!("{BLAST}{RELAX}{DYNAMIC}")),
        blast("mass = 500", "mass = 5"),
        blast("mass = 500", "mass = 5000"),
        blast("z = [1, 2]", "z = [1, 3]").replace(BALL, AROUND),
        blast("radius = 0.7 } }", "radius = 0.7 }, x = [0.9, 1.1] }"),
        deck(&format!("{BLAST}[[charge]]{charge}")),
        deck(&(BLAST.to_owned() + &BESIDE.replace("[3, 0, 0]", "[1, 1, 1]"))),
        deck(&format!("[[refine]]\nfactor = 2\nwhere = {{ z = [0, 1] }}\n{BLAST}")),
        blast("z = [1, 2]", "z = [1, 3]").replace(BALL, AROUND)
            + &BESIDE.replace("[3, 0, 0]", "[1, 1, 3]"),
        deck(&format!("[[charge]]{}", charge.replace(BALL, LINE))),
        deck(&format!(
            "[[refine]]\nfactor = 2\nwhere = {{ z = [0, 1] }}\n[[charge]]{}",
            charge.replace("1.5, 1.5, 1.5", "1.5, 1.5, 1.0")
        )),
        text(
            &[("where = { z = 0.0 }", "where = { z = [0, 1] }")],
            "[[boundary]]\nwhere = { x = 0.0 }\nkind = 'viscous'\n",
        ),
        deck(&format!("{hole}[[boundary]]\nwhere = {{ set = 'rock' }}\nkind = 'viscous'\n")),
        deck(&format!(
            "[[boundary]]\nwhere = {{ y = 0.0 }}\nkind = 'viscous'\n[[fix]]\nwhere = {{ y = 0.0 }}\naxes = 'y'\n{DYNAMIC}"
        )),
        deck(&format!("{removed}{RELAX}{DYNAMIC}")),
        deck(&format!("{removed}{RELAX}{still}")),
        deck("[[probe]]\nname = 'far'\nat = [9, 9, 9]\n"),
    ]
}

#[test]
fn rule_messages() {
    let mut messages = Vec::new();
    for text in broken() {
        let read =
            parse(&text, "deck.toml").and_then(|(deck, source)| source.check(&deck).map(|()| deck));
        let deck = read.unwrap_or_else(|error| panic!("{}", error.report(false)));
        let built = BuiltDeck::new(&deck).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let warnings = built.warnings(&built.model());
        assert!(!warnings.is_empty(), "{text}");
        messages.extend(warnings.iter().map(|warning| (warning.code, warning.to_string())));
    }
    messages.sort();
    messages.dedup();
    let messages: Vec<String> = messages.into_iter().map(|(_, message)| message).collect();
    insta::assert_snapshot!(messages.join("\n"));
}
