//! Limits of the time step, in the report of `--check` and in the summary.

use ddem_io::run::{Event, Observer, Options, inspect, run};
use ddem_io::summary::{Summary, TimeStepLimit};

/// Rock of two cubes over a stiff joint, a thin slab cut off the upper one, and a loose slanted block.
const ROCK: &str = "
[model]
contact = false
[materials.granite]
density = 2700
young = 50e9
poisson = 0.25
[joints.bed]
normal_stiffness = 2e13
shear_stiffness = 1e13
[joints.crack]
normal_stiffness = 2e10
shear_stiffness = 1e10
[contact]
damping = 0.0
[[region]]
name = 'rock'
box = { from = [0, 0, 0], to = [2, 2, 2] }
material = 'granite'
[[cut]]
plane = { dip = 0, dip_direction = 0, through = [1, 1, 1] }
joint = 'bed'
[[cut]]
plane = { dip = 0, dip_direction = 0, through = [1, 1, 1.9] }
joint = 'crack'
[[stage]]
name = 'rest'
kind = 'relax'
[[stage]]
name = 'shake'
kind = 'dynamic'
duration = 1e-5
";

const FLOOR: &str = "[[fix]]\nwhere = { z = 0.0 }\naxes = 'xyz'\n";

/// Stores the limits of the stages.
#[derive(Default)]
struct LimitReader(Vec<(String, TimeStepLimit)>);

impl Observer for LimitReader {
    fn event(&mut self, event: Event<'_>) {
        if let Event::StepLimit { stage, limit } = event {
            self.0.push((stage.to_owned(), limit.clone()));
        }
    }
}

#[test]
fn report_log_and_summary_have_the_limit() {
    let fixed = ROCK.to_owned() + FLOOR;
    let (deck, source) = ddem_deck::parse(&fixed, "rock.toml").unwrap();
    let report = inspect(&deck, &source).unwrap();
    let limit = report.limit.clone().unwrap();
    assert_eq!((limit.kind.as_str(), limit.joint.as_deref()), ("joint", Some("bed")));
    assert_eq!((&limit.blocks[..], limit.step), (&[0, 1][..], report.critical_step));
    // A thin slab limits the step once the joint is soft.
    let soft = fixed.replace("2e13", "2e5").replace("1e13", "1e5");
    let (softer, _) = ddem_deck::parse(&soft, "rock.toml").unwrap();
    let alone = inspect(&softer, &source).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut reader = LimitReader::default();
    run(&deck, &source, &Options::new(&out), &mut reader).unwrap();
    assert_eq!(reader.0, [("shake".to_owned(), limit.clone())]);
    let summary = Summary::read(out.join("summary.json")).unwrap();
    assert_eq!(summary.stages[0].limit, None);
    assert_eq!(summary.stages[1].limit, Some(limit));
    assert_eq!(summary.added_inertia, report.added_inertia);
    assert_eq!(summary.worst_element, report.worst_element);
    // A cell with right angles has parts with right angles.
    let worst = report.worst_element.as_ref().unwrap();
    assert!((worst.scaled_jacobian - 1.0).abs() < 1e-12, "{worst:?}");
    let lines = [report.to_string(), alone.to_string()].concat();
    let kept = [
        "critical step",
        "limited by",
        "shortest steps",
        "        ",
        "worst element",
        "added inertia",
    ];
    let lines: Vec<&str> =
        lines.lines().filter(|line| kept.iter().any(|name| line.starts_with(name))).collect();
    insta::assert_snapshot!(lines.join("\n"));
}

#[test]
fn report_names_blocks_contacts_and_charges() {
    let report = |text: &str| {
        let (deck, source) = ddem_deck::parse(text, "rock.toml").unwrap();
        inspect(&deck, &source).unwrap().limit.unwrap().to_string()
    };
    let rock = ROCK.split("[[region]]").next().unwrap_or_default();
    let cubes = "
[[blocks]]
name = 'large'
size = [1, 1, 1]
material = 'granite'
[[blocks]]
name = 'small'
origin = [5, 0, 0]
size = [0.5, 1, 1]
material = 'granite'
";
    let stage = "[[stage]]\nname = 'fly'\nkind = 'dynamic'\nduration = 1e-5\n";
    let free = format!("{rock}{cubes}{stage}");
    let meets = free.replace("contact = false", "contact = true");
    let stiff = meets.replace("damping = 0.0", "damping = 0.0\nnormal_stiffness = 1e18");
    let rigid = stiff.replace("material = 'granite'\n", "material = 'granite'\nbody = 'rigid'\n");
    // The gas is much stiffer than soft rock.
    let cavity = "
[[blocks]]
size = [3, 3, 3]
count = [3, 3, 3]
material = 'granite'
joint = 'crack'
[[remove]]
where = { x = [1, 2], y = [1, 2], z = [1, 2] }
[[charge]]
where = { sphere = { centre = [1.5, 1.5, 1.5], radius = 0.9 } }
mass = 1000.0
explosive = 'tnt'
";
    let soft = rock.replace("50e9", "1e6").replace("2e10", "1e6").replace("1e10", "1e6");
    let charged = format!("{soft}{cavity}{stage}");
    let lines = [free, stiff, rigid, charged].map(|text| report(&text));
    insta::assert_snapshot!(lines.join("\n"));
}

/// A slab of 1 mm gets the inertia of thicker ones.
#[test]
fn report_has_the_added_inertia() {
    let thin = ROCK.replace("[1, 1, 1.9]", "[1, 1, 1.999]") + FLOOR;
    let (deck, source) = ddem_deck::parse(&thin, "rock.toml").unwrap();
    let report = inspect(&deck, &source).unwrap();
    let added = &report.added_inertia[..];
    assert!(matches!(added, [only] if only.region == "rock" && only.share > 0.0), "{added:?}");
    let text = report.to_string();
    let line = text.lines().find(|line| line.starts_with("added inertia")).unwrap_or_default();
    insta::assert_snapshot!(line);
}
