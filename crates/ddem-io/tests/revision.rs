//! Tests of the build script that finds the revision.
//!
//! Processes that they start would hold the locks of HDF5 files that other tests write.

use std::fs;
use std::path::Path;

use tempfile::tempdir;

#[path = "../build.rs"]
#[allow(dead_code)]
mod build;

/// Output of git in a folder, which must succeed.
fn must(root: &Path, arguments: &[&str]) -> String {
    let user = ["-c", "user.name=a", "-c", "user.email=a@b"];
    build::git(root, &[&user[..], arguments].concat()).expect("git")
}

#[test]
fn revision_is_the_commit_of_the_repository() {
    let root = tempdir().expect("a folder");
    let root = root.path();
    assert_eq!(build::revision(root), None);
    fs::create_dir_all(root.join("crates/ddem-io")).expect("a folder");
    fs::create_dir_all(root.join("docs")).expect("a folder");
    let manifest = root.join("crates/ddem-io/Cargo.toml");
    fs::write(&manifest, "a").expect("a file");
    fs::write(root.join("docs/deck.md"), "a").expect("a file");
    // Sources without a repository, as in a package.
    assert_eq!(build::revision(root), None);
    must(root, &["init", "--quiet"]);
    must(root, &["add", "--all"]);
    must(root, &["commit", "--quiet", "--message", "a"]);
    let commit = must(root, &["rev-parse", "HEAD"]);
    assert_eq!(build::revision(root).as_deref(), Some(&commit[..12]));
    // Documentation does not change numbers, sources do.
    fs::write(root.join("docs/deck.md"), "b").expect("a file");
    assert_eq!(build::revision(root).as_deref(), Some(&commit[..12]));
    fs::write(&manifest, "b").expect("a file");
    assert_eq!(build::revision(root), Some(format!("{}+", &commit[..12])));
}

/// A package in the repository of another project.
#[test]
fn another_repository_gives_no_revision() {
    let root = tempdir().expect("a folder");
    must(root.path(), &["init", "--quiet"]);
    fs::write(root.path().join("a"), "a").expect("a file");
    must(root.path(), &["add", "--all"]);
    must(root.path(), &["commit", "--quiet", "--message", "a"]);
    assert_eq!(build::revision(root.path()), None);
    fs::create_dir_all(root.path().join("vendor/ddem/crates/ddem-io")).expect("a folder");
    fs::write(root.path().join("vendor/ddem/crates/ddem-io/Cargo.toml"), "").expect("a file");
    assert_eq!(build::revision(&root.path().join("vendor/ddem")), None);
}
