//! Starter decks, which `ddem new` writes.

use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use ddem_core::ErrorCode;

/// Starter deck.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Template {
    /// Column of rock that settles under a load
    Column,
    /// Factor of safety of a slope in bedded rock
    Slope,
    /// Tunnel in jointed rock under stress
    Tunnel,
    /// Blast hole behind the face of a bench
    Blast,
    /// Wedge on two joints, cut from a region of rock
    Wedge,
    /// Sample with one joint in a triaxial test
    Sample,
}

/// Deck to write.
#[derive(Debug, Args)]
pub(crate) struct NewArguments {
    /// Kind of the deck
    #[arg(value_name = "TEMPLATE")]
    template: Template,
    /// File to write [default: TEMPLATE.toml]
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// Replace the file if it exists
    #[arg(long)]
    overwrite: bool,
}

/// Reason why no deck was written.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NotWritten {
    /// The file exists.
    #[error(
        "`{}` exists: give another FILE, or --overwrite to replace it [{}]",
        file.display(), ErrorCode::InvalidArgument
    )]
    Exists {
        /// The file.
        file: PathBuf,
    },
    /// The system reported an error.
    #[error(
        "cannot write the deck `{}`: {error}; give a FILE in a folder that exists and that you can write to [{}]",
        file.display(), ErrorCode::FileAccess
    )]
    System {
        /// The file.
        file: PathBuf,
        /// The error of the system, which the message contains.
        error: io::Error,
    },
}

impl Template {
    /// Text of the deck.
    fn text(self) -> &'static str {
        match self {
            Self::Column => include_str!("../templates/column.toml"),
            Self::Slope => include_str!("../templates/slope.toml"),
            Self::Tunnel => include_str!("../templates/tunnel.toml"),
            Self::Blast => include_str!("../templates/blast.toml"),
            Self::Wedge => include_str!("../templates/wedge.toml"),
            Self::Sample => include_str!("../templates/sample.toml"),
        }
    }

    fn default_file(self) -> PathBuf {
        let value = self.to_possible_value();
        let name = value.as_ref().map_or("deck", |value| value.get_name());
        PathBuf::from(format!("{name}.toml"))
    }
}

/// Writes a starter deck and returns its path.
pub(crate) fn write(arguments: &NewArguments) -> Result<PathBuf, NotWritten> {
    let NewArguments { template, file, overwrite } = arguments;
    let file = file.clone().unwrap_or_else(|| template.default_file());
    // `create_new` leaves no moment in which another program could write the file.
    let opened = match overwrite {
        true => File::create(&file),
        false => File::create_new(&file),
    };
    match opened.and_then(|mut open| open.write_all(template.text().as_bytes())) {
        Ok(()) => Ok(file),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(NotWritten::Exists { file }),
        Err(error) => Err(NotWritten::System { file, error }),
    }
}
