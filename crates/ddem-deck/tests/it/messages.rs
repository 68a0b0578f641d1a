//! Snapshots of the messages of decks, one change of a good deck for each message.

use ddem_deck::*;

use crate::lint::text;

/// A text of the deck and its replacement; an empty text stands for the end of the deck.
pub(crate) type DeckEdit = (&'static str, &'static str);

/// Messages about a deck: its mistakes, those of the model or, without any, its warnings.
pub(crate) fn messages(text: &str) -> Vec<String> {
    let lines = |faults: &[ddem_core::Fault]| faults.iter().map(ToString::to_string).collect();
    let deck = match parse(text, "deck.toml") {
        Ok((deck, _)) => deck,
        Err(error) => {
            return error.findings().iter().map(|finding| finding.fault.to_string()).collect();
        }
    };
    match BuiltDeck::new(&deck) {
        Ok(built) => built.warnings(&built.model()).iter().map(ToString::to_string).collect(),
        Err(error) => lines(&error.faults),
    }
}

/// Messages about the changed decks, in order; a message that is there already counts once.
pub(crate) fn all(changes: &[DeckEdit]) -> String {
    let mut found: Vec<String> = Vec::new();
    for (from, to) in changes {
        let changed = match *from {
            "" => text(&[], to),
            from => text(&[(from, to)], ""),
        };
        let messages = messages(&changed);
        assert!(!messages.is_empty(), "nothing is said about {to}");
        for message in messages {
            if !found.contains(&message) {
                found.push(message);
            }
        }
    }
    found.join("\n")
}

macro_rules! changes {
    ($($name:ident: $changes:expr;)+) => {
        $(
            #[test]
            fn $name() {
                let found = all(&$changes);
                insta::assert_snapshot!(found);
            }
        )+
    };
}

const YOUNG: &str = "young = 18e9";
const GRAVITY: &str = "gravity = [0, 0, -10]";
const NAME: &str = "name = 'rock'\n";
const NAMED: &str = "[[blocks]]\n        name = 'rock'\n";

changes! {
    notation: [
        (YOUNG, "young = 20,5e9"),
        (YOUNG, "young = 20*10^9"),
        (YOUNG, "young ="),
        (YOUNG, "young = −18e9"),
        (YOUNG, "young: 18e9"),
        (YOUNG, "young = .5e9"),
        (YOUNG, "young = '20 GPa'"),
        (YOUNG, "E = 18e9"),
        (YOUNG, "young = 1e9\nyoung = 2e9"),
        (NAME, "name =\n"),
        ("material = 'rock'", "material = “rock”"),
        ("material = 'rock'", "material = rock"),
        (GRAVITY, "contact = True"),
        (GRAVITY, "gravity = -9.81"),
        (GRAVITY, "gravity = [0, 0, -9.81"),
        ("[[blocks]]", "[materials.rock]\n[[blocks]]"),
        ("", "[stage]\n[stage]\n"),
        ("", "[lint]\nallow = ['all']\n"),
        ("", "[lint]\nallow = ['mechanism']\n"),
        ("", "[lint]\nallow = ['far-prob']\n"),
        ("", "[output]\ncheckpoint_every = -1\n"),
        ("", "[output]\ncheckpoints = 5\n"),
        ("", "[[stage]]\nname = 'a'\nkind = 'static'\n"),
        ("", "[[probe]]\nname = 'p'\nat = [1, 1, 1]\nquantity = 'temperature'\n"),
        ("where = { z = 0.0 }", "where = 'z = 0'"),
        ("where = { z = 0.0 }", "where = { inside = 3 }"),
        ("axes = 'xyz'", "axes = ['x', 'y', 'z']"),
        ("count = [3, 3, 3]", "count = 3.5"),
        ("", "[[load]]\nwhere = { z = 3.0 }\npressure = 1e6\nhistory = { table = 3 }\n"),
        ("divisions = 1", "divisions = 99999999999999999999999999999999999999999999999"),
    ];
    sets_of_blocks: [
        ("size = [3, 3, 3]", "size = [3, 3, 3]\ndip = 30"),
        ("divisions = 1", "divisions = 1\naxes = [[0, 0, 0], [0, 1, 0], [0, 0, 1]]"),
        ("", "[[blocks]]\nmaterial = 'rock'\nsize = [1, 1, 1]\nmesh = { nodes = [], hexes = [], blocks = [] }\n"),
        ("", "[[blocks]]\nmaterial = 'rock'\njoint = { x = 'seam' }\nmesh = { nodes = [], hexes = [], blocks = [] }\n"),
        ("", "[[refine]]\nwhere = { z = [2, 3] }\nfactor = 1\n"),
        ("", "[materials.'']\ndensity = 1\nyoung = 1e9\npoisson = 0.2\n[joints.'']\nnormal_stiffness = 1e9\nshear_stiffness = 1e9\n"),
        ("", "[[remove]]\nwhere = { set = 'rocks' }\n"),
        (NAMED, "[[remove]]\nwhere = { set = 'rocks' }\n[[blocks]]\n"),
        ("", "[[remove]]\nwhere = { cylinder = { from = [1, 1, 1], to = [1, 1, 1], radius = 0.1 } }\n"),
        ("", "[[remove]]\nwhere = { above = { point = [1, 1, 1], dip = 10 } }\n"),
        ("", "[[remove]]\nwhere = { above = { point = [1, 1, 1], normal = [0, 0, 1], dip = 10 } }\n"),
        ("[[fix]]\n        where = { z = 0.0 }\n        axes = 'xyz'", "[[probe]]\nname = 'p'\nwhere = { z = 0.0 }\nquantity = 'reaction'\n"),
    ];
    charges: [
        ("", "[[charge]]\nwhere = {}\npressure = 1e6\n"),
        ("", "[[charge]]\nwhere = { x = [1, 2] }\n"),
        ("", "[[stage]]\nname = 'fs'\nkind = 'safety'\nbracket = [4, 2]\njoints = []\n"),
        ("cohesion = 1e5", "[joints.stiff]\nnormal_stiffness = 1e9\nshear_stiffness = 1e9\n[[stage]]\nname = 'fs'\nkind = 'safety'\njoints = ['stiff']"),
        ("", "[[charge]]\nwhere = { x = [1, 2] }\nmass = 5\n"),
        ("", "[[charge]]\nwhere = { x = [1, 2] }\nmass = 5\nexplosive = 'tnt'\ngamma = 2\n"),
        ("", "[[charge]]\nwhere = { x = [1, 2] }\nmass = 5\nexplosive = { density = 1.6, detonation_velocity = 7, gamma = 0.5 }\n"),
        ("", "[[charge]]\nwhere = { x = [1, 2] }\npressure = 1e6\ngamma = 1.3\n"),
        ("", "[[charge]]\nwhere = { x = [1, 2] }\npressure = 1e6\ngamma = 0.9\nhistory = 'gas'\n"),
        ("", "[[charge]]\nwhere = { x = [1, 2] }\npressure = 1e6\ndelay = 2\n[[stage]]\nname = 'go'\nkind = 'dynamic'\nduration = 1\n"),
        ("", "[[charge]]\nwhere = { x = [8, 9] }\npressure = 1e6\n"),
        ("", "[[charge]]\nwhere = { x = [0, 3] }\npressure = 1e6\ngamma = 1.3\nhistory = 'gas'\n"),
        ("", "[[charge]]\nwhere = { x = [0, 3] }\npressure = 1e6\nhistory = 'gas'\n"),
        ("", "[[refine]]\nwhere = { x = [1, 2], y = [1, 2], z = [1, 2] }\nfactor = 2\n[[remove]]\nwhere = { x = [1, 2], y = [1, 2], z = [1, 2] }\n[[charge]]\nwhere = { sphere = { centre = [1.5, 1.5, 1.5], radius = 0.4 } }\npressure = 1e6\n"),
        ("", "[[remove]]\nwhere = { x = [1, 2], y = [1, 2], z = [1, 2] }\n[[charge]]\nwhere = { sphere = { centre = [2.5, 2.5, 2.2], radius = 0.1 } }\npressure = 1e6\n"),
        ("", "[[remove]]\nwhere = { x = [1, 2], y = [1, 2], z = [1, 2] }\n[[remove]]\nfrom = 'dig'\nwhere = { z = [2, 3] }\n[[charge]]\nwhere = { sphere = { centre = [1.5, 1.5, 1.5], radius = 0.7 } }\npressure = 1e6\n[[stage]]\nname = 'go'\nkind = 'dynamic'\nduration = 1\n[[stage]]\nname = 'dig'\nkind = 'dynamic'\nduration = 1\n"),
        ("[[fix]]", "[[charge]]\nwhere = { x = [8, 9], set = 'far' }\npressure = 1e6\n[[blocks]]\nname = 'far'\norigin = [8, 0, 0]\nsize = [1, 1, 1]\nmaterial = 'rock'\n[[fix]]"),
        ("", "[[refine]]\nfactor = 2\nwhere = { z = [0, 1] }\n[[charge]]\nwhere = { z = [0.95, 1.05], x = [0, 3] }\npressure = 1e6\n"),
    ];
    supports_and_histories: [
        ("axes = 'xyz'", "axes = ''"),
        ("axes = 'xyz'", "axes = 'xyz'\nvelocity = [0, 0, 1]\ndisplacement = [0, 0, 1]"),
        ("axes = 'xyz'", "axes = 'xyz'\ndisplacement = [0, 0, 1]\n[[stage]]\nname = 'go'\nkind = 'dynamic'\nduration = 1"),
        ("", "[[load]]\nwhere = { z = 3.0 }\npressure = 1e6\nhistory = { table = [] }\n"),
        ("", "[[load]]\nwhere = { z = 3.0 }\npressure = 1e6\nhistory = { duvall = { alpha = 2, beta = 1 } }\n"),
        ("", "[[load]]\nwhere = { z = 3.0 }\npressure = 1e6\nhistory = { triangle = { rise = 1, fall = 2, duration = 3 } }\n"),
        ("", "[[load]]\nwhere = { z = 3.0 }\npressure = 1e6\nhistory = { triangle = { rise = 1, duration = 0.5 } }\n"),
        ("", "[[load]]\nwhere = { x = 9.0, z = 3.0 }\nline = [0, 0, 1]\n"),
        ("", "[[load]]\nwhere = { x = 9.0 }\nforce = [0, 0, 1]\n"),
        ("", "[[load]]\nwhere = { x = 9.0 }\npressure = 1\n"),
    ];
}
