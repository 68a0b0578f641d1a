//! Paths that were probably meant by a path that does not exist.

use std::path::{Path, PathBuf};

use crate::schema::names;

/// Path that was probably meant by a missing path, among the `wanted` ones: the entry of the same
/// folder with the nearest name. If the folder is missing, the folder with the nearest name takes
/// its place. `None` if no name is near.
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
    let nearest = nearest(name, &names)?;
    (nearest != name).then(|| folder.join(nearest))
}

/// Nearest of some names of files. A common ending, such as `.toml`, makes names no more alike.
fn nearest<'a>(name: &str, names: &'a [String]) -> Option<&'a str> {
    let ending = Path::new(name).extension().and_then(|ending| ending.to_str()).unwrap_or("");
    let stem = |name: &'a str| name.strip_suffix(ending)?.strip_suffix('.');
    let own = name.strip_suffix(ending).and_then(|stem| stem.strip_suffix('.'));
    let alike = own.and_then(|own| {
        let near = names::nearest(own, names.iter().filter_map(|name| stem(name)))?;
        names.iter().find(|name| stem(name) == Some(near))
    });
    let others = names.iter().filter(|name| own.is_none() || stem(name).is_none());
    let alike = alike.map(String::as_str);
    alike.or_else(|| names::nearest(name, others.map(String::as_str)))
}
