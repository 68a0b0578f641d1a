//! Git revision of the sources, for the results of release builds. There is none outside of the repository, as in a
//! package. Builds for tests have none either: each commit would compile all tests again.

use std::path::Path;
use std::process::Command;

/// Everything that the numbers of a run depend on, relative to the repository.
const SOURCES: [&str; 9] = [
    "Cargo.lock",
    "Cargo.toml",
    "crates/ddem-core",
    "crates/ddem-cut",
    "crates/ddem-deck",
    "crates/ddem-io",
    "crates/ddem-joint",
    "crates/ddem-mechanics",
    "crates/ddem-mesh",
];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let version = env!("CARGO_PKG_VERSION");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let release = std::env::var("PROFILE").as_deref() == Ok("release");
    let Some(revision) = release.then(|| revision(&root)).flatten() else {
        println!("cargo::rustc-env=DDEM_FULL_VERSION={version}");
        return;
    };
    println!("cargo::rustc-env=DDEM_FULL_VERSION={version} ({revision})");
    println!("cargo::rustc-env=DDEM_REVISION={revision}");
    // The folder of a linked work tree has these files elsewhere.
    for name in ["HEAD", "logs/HEAD"] {
        if let Some(file) = git(&root, &["rev-parse", "--git-path", name]) {
            watch(&root.join(file));
        }
    }
    // A change of these crates compiles this one again in any case.
    SOURCES.iter().for_each(|source| watch(&root.join(source)));
}

/// Commit of the sources in a repository, with a `+` if files have changed since.
pub(crate) fn revision(root: &Path) -> Option<String> {
    // A package unpacked in the repository of somebody else must not get the revision of that.
    if !root.join(".git").exists() || !root.join("crates/ddem-io/Cargo.toml").exists() {
        return None;
    }
    let commit = git(root, &["rev-parse", "--short=12", "HEAD"])?;
    let same = [&["diff", "--quiet", "HEAD", "--"][..], &SOURCES].concat();
    let mark = if git(root, &same).is_some() { "" } else { "+" };
    Some(commit + mark)
}

/// Lets this program run again after a change of a file or a folder. One that is missing would always count as changed.
fn watch(path: &Path) {
    if path.exists() {
        println!("cargo::rerun-if-changed={}", path.display());
    }
}

/// Output of git without the end of the line, if it succeeds.
pub(crate) fn git(root: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").current_dir(root).args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok().filter(|_| output.status.success())?;
    Some(text.trim().to_owned())
}
