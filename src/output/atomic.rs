//! Files that appear whole or not at all.

use super::ImageError;
use std::io::{self, Write};
use std::path::Path;

/// Writes a file under a temporary name in the target's folder, syncs it and renames it over the target.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    put(path, bytes).map_err(|source| ImageError::NotWritable {
        path: path.into(),
        source,
    })
}

/// The same without waiting for the disk: after a power failure the file may be empty or an older one. For many small files
/// that can be made again.
pub fn write_unsynced(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let folder = folder(path);
    let write = || -> io::Result<()> {
        let mut file = part().tempfile_in(folder)?;
        file.write_all(bytes)?;
        file.persist(path).map(drop).map_err(|e| e.error)
    };
    write().map_err(|source| ImageError::NotWritable {
        path: path.into(),
        source,
    })
}

/// Finds out before a long render whether a file can be written where `path` lies; leaves nothing behind.
pub fn check_writable(path: &Path) -> Result<(), ImageError> {
    let folder = folder(path);
    std::fs::create_dir_all(folder)
        .and_then(|()| tempfile::tempfile_in(folder).map(drop))
        .and_then(|()| match std::fs::metadata(path) {
            Ok(there) if there.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
            // A device would be replaced, not written to.
            Ok(there) if !there.is_file() => Err(io::Error::other("is there and is no file")),
            _ => Ok(()),
        })
        .map_err(|source| ImageError::NotWritable {
            path: path.into(),
            source,
        })
}

/// Writes what `fill` writes under a temporary name in the target's folder, syncs it and renames it over the target. The
/// name is always the same one, so that a process killed on the way leaves at most one such file, and the next one
/// writes over it.
pub fn write_streamed(
    path: &Path,
    fill: &mut dyn FnMut(&mut dyn Write) -> io::Result<()>,
) -> Result<(), ImageError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut builder = tempfile::Builder::new();
    let prefix = format!(".{name}");
    builder.prefix(&prefix).suffix(".part").rand_bytes(0);
    let left = folder(path).join(format!("{prefix}.part"));
    std::fs::remove_file(left)
        .or_else(|e| match e.kind() {
            io::ErrorKind::NotFound => Ok(()),
            _ => Err(e),
        })
        .and_then(|()| replace(path, &mut builder, fill))
        .map_err(|source| ImageError::NotWritable {
            path: path.into(),
            source,
        })
}

fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    }
}

fn put(path: &Path, bytes: &[u8]) -> io::Result<()> {
    replace(path, &mut part(), &mut |w| w.write_all(bytes))
}

/// Temporary files of names of their own.
fn part() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".metrolux-").suffix(".part");
    readable(&mut builder);
    builder
}

/// Temporary files are private by default; the final file should follow the umask like any other.
fn readable(builder: &mut tempfile::Builder) {
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
}

fn replace(
    path: &Path,
    builder: &mut tempfile::Builder,
    fill: &mut dyn FnMut(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let folder = folder(path);
    readable(builder);
    let file = builder.tempfile_in(folder)?;
    let mut out = io::BufWriter::with_capacity(1 << 16, file);
    fill(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    // The rename itself must reach the disk. Not every file system lets a folder be opened and synced.
    if let Ok(dir) = std::fs::File::open(folder) {
        let _ = dir.sync_all();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_whole_files_and_leaves_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        write_atomic(&path, b"one").unwrap();
        write_atomic(&path, b"two").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_folder_is_the_outputs_fault() {
        let dir = tempfile::tempdir().unwrap();
        let e = write_atomic(&dir.path().join("no/such/a.exr"), b"x").unwrap_err();
        assert_eq!(e.exit_code(), 4);
        // A folder in the target's place.
        assert!(write_atomic(dir.path(), b"x").is_err());
        assert_eq!(check_writable(dir.path()).unwrap_err().exit_code(), 4);
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_not_written_over() {
        assert_eq!(
            check_writable("/dev/null".as_ref())
                .unwrap_err()
                .exit_code(),
            4
        );
    }
}
