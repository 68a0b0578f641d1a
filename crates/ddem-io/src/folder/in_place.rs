//! Looks at a folder before and during a run: can it be written to?

use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::Path;

use crate::output_error::OutputError;

/// Checks that the folder can be written to by writing a file; permissions do not show it. A run that is killed here
/// leaves the file, which the next run removes.
pub(super) fn try_writing(folder: &Path) -> io::Result<()> {
    let path = folder.join(".ddem.part");
    File::create(&path).and_then(|_| match fs::remove_file(&path) {
        // Another run that begins at the same time has removed it.
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        removed => removed,
    })
}

/// Checks that the files of a run are still in their place, and that they and their folder can be written to.
pub(crate) fn check_in_place<'a>(
    folder: &Path,
    mut files: impl Iterator<Item = &'a Path>,
) -> Result<(), OutputError> {
    let open = |file: &Path| File::options().append(true).open(file).map(drop);
    files.try_for_each(|file| unless_passing(file, open(file)))?;
    unless_passing(folder, try_writing(folder))
}

/// Error of a file that is gone or protected. Others, such as a full disk, may pass before the next output.
fn unless_passing(file: &Path, done: io::Result<()>) -> Result<(), OutputError> {
    match done {
        Err(error)
            if matches!(
                error.kind(),
                ErrorKind::NotFound
                    | ErrorKind::NotADirectory
                    | ErrorKind::PermissionDenied
                    | ErrorKind::ReadOnlyFilesystem
            ) =>
        {
            Err(OutputError::io(file, "writing", error))
        }
        _ => Ok(()),
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    /// Results whose file is gone, whose disk or folder is protected, and whose disk is full.
    #[test]
    fn lost_and_protected_files() {
        use nix::errno::Errno;
        let message = |errno: Errno| {
            let done = Err(io::Error::from(errno));
            match unless_passing(Path::new("out/blocks.vtkhdf"), done) {
                Err(error) => error.to_string(),
                Ok(()) => format!("no message: {errno}"),
            }
        };
        let errors = [Errno::ENOENT, Errno::EROFS, Errno::EACCES, Errno::ENOSPC];
        insta::assert_snapshot!(errors.map(message).join("\n"));
    }
}
