//! Files of one command that must not be the same one: what is written would take the place of another, or of what is read.

use super::CliError;
use std::path::{Path, PathBuf};

/// Files of one command, each with what it is for.
pub type Files<'a> = Vec<(&'static str, &'a Path)>;

/// Several files for the same thing.
pub fn each<'a>(
    what: &'static str,
    files: impl IntoIterator<Item = &'a PathBuf>,
) -> impl Iterator<Item = (&'static str, &'a Path)> {
    files.into_iter().map(move |f| (what, f.as_path()))
}

/// Refuses a file that is written twice, or written and read.
///
/// # Errors
/// Which, and what for.
pub fn refuse_shared(written: &Files, read: &Files) -> Result<(), CliError> {
    let places: Vec<PathBuf> = written.iter().map(|w| place(w.1)).collect();
    for (i, ((what, file), at)) in written.iter().zip(&places).enumerate() {
        let before = written[..i].iter().zip(&places);
        let twice = before.filter(|(_, p)| *p == at).map(|(w, _)| w.0);
        let read = read.iter().filter(|r| place(r.1) == *at).map(|r| r.0);
        if let Some(other) = twice.chain(read).next() {
            return Err(CliError::Usage(format!(
                "{} is named for two things: found {other} and {what}, expected a file for each",
                file.display()
            )));
        }
    }
    Ok(())
}

/// Where a file is or will be, by its one name.
fn place(file: &Path) -> PathBuf {
    let whole = || {
        let folder = file.parent().filter(|p| !p.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
        Some(folder.join(file.file_name()?))
    };
    file.canonicalize()
        .ok()
        .or_else(whole)
        .unwrap_or_else(|| file.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_file_under_two_names_is_found() {
        let dir = tempfile::tempdir().expect("a folder");
        let at = |name: &str| dir.path().join(name);
        std::fs::write(at("scene"), "").expect("written");
        std::fs::create_dir(at("in")).expect("made");
        let shared = |written: &[PathBuf], read: &[PathBuf]| {
            let (w, r) = (each("w", written).collect(), each("r", read).collect());
            refuse_shared(&w, &r).is_err()
        };
        assert!(!shared(&[at("a"), at("b")], &[at("scene")]));
        assert!(shared(&[at("a"), at("in/../a")], &[]));
        assert!(shared(&[at("in/../scene")], &[at("scene")]));
        assert!(!shared(&[at("a")], &[at("scene"), at("scene")]));
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(at("scene"), at("link")).expect("made");
            assert!(shared(&[at("link")], &[at("scene")]));
        }
    }
}
