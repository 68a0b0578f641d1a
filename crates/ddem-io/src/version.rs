//! Version and revision of the program, which its results carry.

/// Version of ddem.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Git commit of the sources, with a `+` if they were changed afterwards. `None` if the program was not built in the
/// repository, or not in a release build.
pub const REVISION: Option<&str> = option_env!("DDEM_REVISION");

/// Version, with the revision in brackets if it is known.
pub const FULL_VERSION: &str = env!("DDEM_FULL_VERSION");
