//! Messages of failures that a test of the command cannot cause everywhere.

use std::io;

use super::*;

#[test]
fn failures_name_the_options_that_help() {
    let full = || OutputError::DiskFull {
        path: "out/blocks.vtkhdf".into(),
        operation: "writing",
        source: io::Error::from(io::ErrorKind::StorageFull).into(),
    };
    let failures: [RunFailure; 3] = [
        FolderError::InUse { folder: "out".into() }.into(),
        FolderError::NotWritable { source: full() }.into(),
        full().into(),
    ];
    insta::assert_snapshot!(failures.each_ref().map(advised).join("\n"));
}
