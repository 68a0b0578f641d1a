//! Advice on command-line options after an error.

use ddem_io::OutputError;
use ddem_io::folder::FolderError;
use ddem_io::run::RunFailure;

/// Message of a failure with the options that help.
pub(crate) fn advised(failure: &RunFailure) -> String {
    let (text, code) = (failure.to_string(), failure.code());
    match advice(failure) {
        "" => text,
        advice => format!("{}{advice} [{code}]", code.strip(&text)),
    }
}

/// End of a message: the options that help, or an empty string.
fn advice(failure: &RunFailure) -> &'static str {
    match failure {
        RunFailure::Output(error) => room(error),
        RunFailure::Folder(error) => folder(error),
        _ => "",
    }
}

fn folder(error: &FolderError) -> &'static str {
    match error {
        FolderError::OtherDeck { .. } => {
            ": give another --out, or run without --resume and --overwrite to keep them"
        }
        FolderError::ForeignFile { .. } => ": give another --out or delete the file",
        FolderError::NotAFolder { .. } => ": give another --out",
        FolderError::InUse { .. } => ": wait until it has finished or give another --out",
        FolderError::DeckChanged { .. } => ": restore it, or run without --resume to start over",
        FolderError::NotWritable { source } => match room(source) {
            "" if source.is_beyond_limit() => "",
            "" => ": give another --out",
            more => more,
        },
        _ => "",
    }
}

fn room(error: &OutputError) -> &'static str {
    match error {
        OutputError::DiskFull { .. } => ": free some space or give another --out",
        _ => "",
    }
}

#[cfg(test)]
mod tests;
