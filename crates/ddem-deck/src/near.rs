//! Paths that were probably meant where there is nothing.

use std::path::{Path, PathBuf};

use crate::schema::names;

/// Path of the entry beside a path whose name is nearest to that of the path, of the entries that are wanted, or of the
/// entry of this name in the folder that is nearest to a folder that is not there; none where no name is near.
#[must_use]
pub fn near(path: &Path, wanted: impl Fn(&Path) -> bool + Copy) -> Option<PathBuf> {
    let folder = path.parent()?;
    let name = path.file_name()?.to_str()?;
    if !folder.as_os_str().is_empty() && !folder.exists() {
        let meant = near(folder, Path::is_dir)?.join(name);
        return if wanted(&meant) && meant.exists() { Some(meant) } else { near(&meant, wanted) };
    }
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let entries = std::fs::read_dir(here).ok()?.flatten();
    let mut names: Vec<String> = entries
        .filter(|entry| wanted(&entry.path()))
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect();
    // Folders are listed in any order.
    names.sort();
    let nearest = names::nearest(name, names.iter().map(String::as_str));
    nearest.filter(|nearest| *nearest != name).map(|nearest| folder.join(nearest))
}
