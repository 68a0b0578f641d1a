//! Decks and files with random changes: each is read or refused, without a panic, in bounded time.
//!
//! `DDEM_FUZZ=SECONDS cargo test --release -p ddem-deck --test it fuzz` tries as many as fit in that time.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use ddem_deck::{BuiltDeck, Deck, Size};
use toml::{Table, Value};

use crate::rock_files;

/// Decks and changed files that the usual tests try.
const TRIES: u64 = 300;
/// Time that one deck may take.
const LONGEST: Duration = Duration::from_secs(20);
/// Size above which a program refuses a model, because it has no more memory.
const MOST_BYTES: f64 = 2e8;

/// Decks that are changed.
const BASES: [&str; 6] = [
    super::GOOD,
    include_str!("../../../../examples/blast.toml"),
    include_str!("../../../../examples/wedge.toml"),
    include_str!("../../../../examples/tunnel.toml"),
    include_str!("../../../../examples/cut.toml"),
    include_str!("../../../../examples/slope-safety.toml"),
];

/// Sequence of random choices (xorshift).
pub(crate) struct Choices(pub(crate) u64);

impl Choices {
    pub(crate) fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % n.max(1)
    }

    pub(crate) fn one<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.below(of.len())]
    }

    /// A value that hardly any key expects.
    fn odd(&mut self) -> Value {
        const NUMBERS: [f64; 12] = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            0.0,
            -0.0,
            -1.0,
            1e-320,
            1e-9,
            0.5,
            2.0,
            1e16,
            f64::MAX,
        ];
        const WHOLE: [i64; 8] = [0, -1, 1, 3, 100, 1 << 20, i64::MAX, i64::MIN];
        const WORDS: [&str; 8] = ["", "rock", "xyz", "\0", "auto", "shake", "../../", "ε🪨"];
        match self.below(9) {
            0..3 => Value::Float(*self.one(&NUMBERS)),
            3 | 4 => Value::Integer(*self.one(&WHOLE)),
            5 => Value::String((*self.one(&WORDS)).to_owned()),
            6 => Value::Boolean(self.below(2) == 0),
            7 => {
                let n = self.below(8);
                Value::Array((0..n).map(|_| Value::Float(*self.one(&NUMBERS))).collect())
            }
            _ => {
                let mut deep = Value::Array(Vec::new());
                for _ in 0..self.below(100) {
                    deep = match self.below(2) {
                        0 => Value::Array(vec![deep]),
                        _ => Value::Table(Table::from_iter([("where".to_owned(), deep)])),
                    };
                }
                deep
            }
        }
    }

    /// Changes a value, or one inside it.
    fn change(&mut self, value: &mut Value, keys: &[&str]) {
        let inside = self.below(4) > 0;
        match value {
            Value::Table(table) if inside => self.change_table(table, keys),
            Value::Array(list) if inside && !list.is_empty() => {
                let at = self.below(list.len());
                match self.below(8) {
                    0 => drop(list.remove(at)),
                    1 => list.push(list[at].clone()),
                    _ => self.change(&mut list[at], keys),
                }
            }
            Value::Float(number) if self.below(2) == 0 => {
                *number *= self.one(&[-1.0, 0.0, 0.5, 1.0 + 1e-12, 3.0, 100.0]);
            }
            Value::Integer(number) if self.below(2) == 0 => {
                *number = number.wrapping_mul(*self.one(&[-1, 0, 2, 3]));
            }
            value => *value = self.odd(),
        }
    }

    /// Flips, removes, adds and repeats bytes.
    fn change_bytes(&mut self, bytes: &mut Vec<u8>) {
        const ODD: [&[u8]; 14] = [
            b"nan",
            b"inf",
            b"-",
            b"1e308",
            b"1e-320",
            b"\n",
            b",",
            b" ",
            b"\xff",
            b"999999999999",
            b"[[",
            b"{",
            b"'",
            b"=",
        ];
        for _ in 0..self.below(5) {
            let at = self.below(bytes.len());
            match self.below(4) {
                0 if !bytes.is_empty() => bytes[at] ^= 1 << self.below(8),
                1 if self.below(4) == 0 => bytes.truncate(at),
                1 => drop(bytes.drain(at..(at + self.below(20)).min(bytes.len()))),
                2 => drop(bytes.splice(at..at, self.one(&ODD).iter().copied())),
                _ => bytes.extend_from_within(at..),
            }
        }
    }

    fn change_table(&mut self, table: &mut Table, keys: &[&str]) {
        let own: Vec<String> = table.keys().cloned().collect();
        if own.is_empty() || self.below(6) == 0 {
            let key = if keys.is_empty() { "x" } else { self.one(keys) };
            table.insert(key.to_owned(), self.odd());
            return;
        }
        let key = self.one(&own).clone();
        if self.below(10) == 0 {
            table.remove(&key);
        } else if let Some(value) = table.get_mut(&key) {
            let below = ddem_deck::section_keys(&key);
            let below = if below.is_empty() { keys } else { &below };
            self.change(value, below);
        }
    }
}

/// Does all that `--check` does with a deck. Returns true if it can be built.
pub(crate) fn use_deck(deck: &Deck) -> bool {
    let text = ddem_deck::write(deck);
    if let Ok(text) = &text {
        let _ = ddem_deck::parse_alone(text, "written.toml");
    }
    if !ddem_deck::check(deck).is_empty() || Size::of(deck).bytes > MOST_BYTES {
        return false;
    }
    let Ok(built) = BuiltDeck::new(deck) else { return false };
    let model = built.model();
    let _ = (built.warnings(&model), built.interfaces(), built.selections());
    true
}

/// Tries inputs that `attempt` makes of a seed and uses; it sets a text that describes them. Returns the number
/// of tries.
pub(crate) fn try_all(attempt: impl Fn(u64, &mut String)) -> u64 {
    let seconds = std::env::var("DDEM_FUZZ").ok().map(|seconds| seconds.parse().unwrap());
    let (start, mut slowest) = (Instant::now(), Duration::ZERO);
    let mut tries = 0;
    while seconds.map_or(tries < TRIES, |most| start.elapsed().as_secs_f64() < most) {
        let seed = (tries + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let (mut text, begun) = (String::new(), Instant::now());
        let done = catch_unwind(AssertUnwindSafe(|| attempt(seed, &mut text)));
        assert!(done.is_ok(), "try {tries} panics:\n{text}");
        let took = begun.elapsed();
        assert!(took < LONGEST, "try {tries} takes {took:?}:\n{text}");
        slowest = slowest.max(took);
        tries += 1;
    }
    println!("{tries} tries, the slowest in {slowest:?}");
    tries
}

#[test]
fn changed_decks_never_panic() {
    let bases = BASES.map(|text| text.parse::<Table>().unwrap());
    let sections: Vec<&str> = ddem_deck::keys("Where");
    try_all(|seed, text| {
        let mut choices = Choices(seed);
        let mut table = choices.one(&bases).clone();
        for _ in 0..1 + choices.below(4) {
            choices.change_table(&mut table, &sections);
        }
        *text = table.to_string();
        if let Ok(deck) = ddem_deck::from_table(&table) {
            let _ = use_deck(&deck);
        }
        // The same as a text, with a report that shows it.
        if let Err(error) = ddem_deck::parse_alone(text, "deck.toml") {
            assert!(!error.report(false).is_empty());
        }
    });
}

/// Texts are only read and checked, so that many can be tried.
#[test]
fn changed_texts_never_panic() {
    try_all(|seed, text| {
        let mut choices = Choices(seed);
        let mut bytes = choices.one(&BASES).as_bytes().to_vec();
        choices.change_bytes(&mut bytes);
        *text = String::from_utf8_lossy(&bytes).into_owned();
        if let Ok((deck, _)) = ddem_deck::parse_alone(text, "deck.toml") {
            let _ = ddem_deck::check(&deck);
        }
    });
}

/// Files that a deck names: a topography in both forms, an STL surface in both forms, a table of fractures, and
/// regions as STL, OBJ and tessellation.
fn files() -> [(&'static str, Vec<u8>); 8] {
    let text = |text: &str| text.as_bytes().to_vec();
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 1\nvertex 4 0 1\nvertex 0 4 1\nendloop\nendfacet\n";
    let mut binary = vec![0; 80];
    binary.extend(1_u32.to_le_bytes());
    for number in [0.0_f32, 0.0, 1.0, 0.0, 0.0, 1.0, 4.0, 0.0, 1.0, 0.0, 4.0, 1.0] {
        binary.extend(number.to_le_bytes());
    }
    binary.extend([0, 0]);
    let grid = "ncols 3\nnrows 2\nxllcorner -1\nyllcorner -1\ncellsize 3\n1 2 1\n2 1.5 2\n";
    let discs = "x,y,z,dip,dip_direction,radius\n1,1,1,30,40,1.5\n2,1,1,80,10,2\n";
    [
        ("ground", text("-1,-1,2.5\n5,-1,2\n-1,5,2.5\n5,5,1.5\n")),
        ("ground", text(grid)),
        ("pit.stl", text(&format!("solid pit\n{facet}endsolid pit\n"))),
        ("pit.stl", binary),
        ("discs.csv", text(discs)),
        ("body.stl", text(&rock_files::body())),
        ("stones.obj", text(include_str!("decks/pair.obj"))),
        ("grains.tess", text(&rock_files::grains())),
    ]
}

/// A material and a joint.
pub(crate) const ROCK: &str = "
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
normal_stiffness = 1e10
shear_stiffness = 1e10
";

/// Decks that name the files.
fn deck_of(file: &str) -> String {
    let blocks = "[[blocks]]\nsize = [4, 4, 4]\ncount = [2, 2, 2]\nmaterial = 'rock'\njoint = 'seam'\ndivisions = 1\n";
    let region = "[[region]]\nbox = { from = [0, 0, 0], to = [3, 3, 3] }\nmaterial = 'rock'\n[[cut]]\njoint = 'seam'\n";
    let end =
        "[[fix]]\nwhere = { z = 0.0 }\naxes = 'xyz'\n[[stage]]\nname = 'rest'\nkind = 'relax'\n";
    let rest = match file {
        "ground" => {
            format!("{blocks}[[remove]]\nwhere = {{ above = {{ topography = 'ground' }} }}\n")
        }
        "pit.stl" => format!("{region}surface = 'pit.stl'\n"),
        "body.stl" => "[[region]]\nmaterial = 'rock'\nfile = 'body.stl'\n".to_owned(),
        "stones.obj" | "grains.tess" => {
            format!("[[region]]\nmaterial = 'rock'\njoint = 'seam'\nfile = '{file}'\n")
        }
        _ => format!("{region}dfn = {{ file = 'discs.csv' }}\n"),
    };
    format!("{ROCK}{rest}{end}")
}

#[test]
fn changed_files_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let files = files();
    try_all(|seed, text| {
        let mut choices = Choices(seed);
        let (name, bytes) = choices.one(&files);
        let mut bytes = bytes.clone();
        choices.change_bytes(&mut bytes);
        *text = format!("{name}: {:?}", String::from_utf8_lossy(&bytes));
        std::fs::write(folder.path().join(name), bytes).unwrap();
        let deck = folder.path().join("deck.toml");
        std::fs::write(&deck, deck_of(name)).unwrap();
        match ddem_deck::read(&deck) {
            Ok((deck, _)) => drop(use_deck(&deck)),
            Err(error) => assert!(!error.report(false).is_empty()),
        }
    });
}
