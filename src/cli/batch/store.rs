//! The folder of a batch: what is done, checkpoints of what is not, the log, the contact sheet.

use super::expand::Job;
use crate::cli::CliError;
use crate::cli::identity::machine;
use crate::output::{ImageError, write_unsynced};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// A file as it was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stamp {
    /// Which.
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// When it was changed last, nanoseconds since 1970.
    pub changed: u64,
    /// Checksum of what it holds, if that was looked at.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crc: Option<u32>,
}

impl Stamp {
    /// Of a file as it is now, without a look at what it holds. `None` if it is not there.
    pub fn of(path: &Path) -> Option<Self> {
        let meta = fs::metadata(path).ok()?;
        let since = meta.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
        Some(Self {
            path: path.into(),
            bytes: meta.len(),
            changed: since.as_nanos() as u64,
            crc: None,
        })
    }

    /// The same with the checksum.
    pub fn with_sum(path: &Path) -> Option<Self> {
        let crc = Some(crc32fast::hash(&fs::read(path).ok()?));
        Some(Self {
            crc,
            ..Self::of(path)?
        })
    }

    /// The file is as it was: by its time, else by what it holds.
    pub fn holds(&self) -> bool {
        let Some(now) = Self::of(&self.path) else {
            return false;
        };
        now.bytes == self.bytes
            && (now.changed == self.changed
                || self.crc.is_some()
                    && Self::with_sum(&self.path).is_some_and(|n| n.crc == self.crc))
    }

    /// It was changed after this moment, or nobody knows when.
    pub fn younger_than(&self, moment: SystemTime) -> bool {
        let since = moment.duration_since(UNIX_EPOCH);
        since.map_or(true, |t| self.changed >= t.as_nanos() as u64)
    }
}

/// What is kept of a job that is done.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Done {
    /// The job's name.
    pub name: String,
    /// What its images depend on beside the scene, see [`settings`].
    pub settings: String,
    /// Hash of the scene.
    pub scene_hash: String,
    /// The scene's files; empty if they changed while they were read.
    pub files: Vec<Stamp>,
    /// The images.
    pub outputs: Vec<Stamp>,
    /// Exit code: 0, or 3 where faults were counted.
    pub code: u8,
    /// Wall time of the rendering.
    pub seconds: f64,
    /// Relative error.
    pub error: Option<f64>,
    /// Size of the image.
    pub size: [usize; 2],
    /// The closing line of the render.
    pub summary: String,
    /// A small picture, as a URI.
    pub picture: String,
}

impl Done {
    /// All images are there as they were written.
    pub fn is_there(&self) -> bool {
        self.outputs.iter().all(Stamp::holds)
    }

    /// The scene's files are as they were.
    pub fn is_of_these_files(&self) -> bool {
        !self.files.is_empty() && self.files.iter().all(Stamp::holds)
    }
}

/// What a job's images depend on beside the scene, as text.
pub fn settings(job: &Job) -> String {
    let version = env!("CARGO_PKG_VERSION");
    format!("{version} {} {}", machine(), job.plain.join("\u{1f}"))
}

/// The folder.
pub struct Store {
    folder: PathBuf,
    /// Files below this are kept by their path from there, so that all of it may be moved.
    base: PathBuf,
    /// Checkpoints that were there at first, by what stands before their key.
    cut: HashMap<PathBuf, Vec<PathBuf>>,
    /// Locked as long as a batch is at work here.
    _lock: Option<fs::File>,
}

impl Store {
    /// Makes the folder if it is not there, and keeps other batches out of it until this is dropped or the process ends,
    /// however it does.
    ///
    /// # Errors
    /// A folder that cannot be made or locked, or in which another batch is at work.
    pub fn open(folder: &Path, base: &Path) -> Result<Self, CliError> {
        let failed = |path: &Path, source| {
            let path = path.into();
            CliError::Output(ImageError::NotWritable { path, source })
        };
        let jobs = folder.join("jobs");
        fs::create_dir_all(&jobs).map_err(|e| failed(&jobs, e))?;
        let path = folder.join("lock");
        // Nothing is written to it, and it stays: one that was removed could be locked twice.
        let lock = fs::File::options().append(true).create(true).open(&path);
        let lock = lock.map_err(|e| failed(&path, e))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(fs::TryLockError::WouldBlock) => {
                return Err(CliError::Usage(format!(
                    "{}: another metrolux batch is at work in this folder; expected one at a time",
                    folder.display()
                )));
            }
            Err(fs::TryLockError::Error(e)) => return Err(failed(&path, e)),
        }
        // What the batch before this one left is looked for now, when it can leave no more.
        let mut store = Self::at(folder, base);
        store._lock = Some(lock);
        Ok(store)
    }

    /// A folder that may not be there.
    pub fn at(folder: &Path, base: &Path) -> Self {
        let mut cut: HashMap<PathBuf, Vec<PathBuf>> = HashMap::new();
        let files = fs::read_dir(folder.join("jobs")).into_iter().flatten();
        for run in files.flatten().map(|f| f.path()) {
            if run.extension().is_some_and(|e| e == "run") {
                // NAME.KEY.run
                let name = run.with_extension("").with_extension("");
                cut.entry(name).or_default().push(run);
            }
        }
        Self {
            folder: folder.into(),
            base: base.into(),
            cut,
            _lock: None,
        }
    }

    /// A file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// A job's file. Names that are no file names are changed so that they stay apart.
    fn of_job(&self, name: &str, ending: &str) -> PathBuf {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.+=,".contains(c);
        let mut safe: String = name
            .chars()
            .map(|c| if plain(c) { c } else { '_' })
            .collect();
        if safe != name || name.starts_with('.') || name.len() > 100 {
            safe.truncate(100);
            safe = format!("_{safe}-{:08x}", crc32fast::hash(name.as_bytes()));
        }
        self.folder.join("jobs").join(format!("{safe}{ending}"))
    }

    /// What is kept of a job, if it is done.
    pub fn read(&self, name: &str) -> Option<Done> {
        let text = fs::read(self.of_job(name, ".json")).ok()?;
        let mut done: Done = serde_json::from_slice(&text).ok()?;
        for s in done.files.iter_mut().chain(&mut done.outputs) {
            s.path = self.base.join(&s.path);
        }
        Some(done)
    }

    /// Keeps that a job is done.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, done: &Done) -> Result<(), CliError> {
        let mut done = done.clone();
        for s in done.files.iter_mut().chain(&mut done.outputs) {
            if let Ok(below) = s.path.strip_prefix(&self.base) {
                s.path = below.into();
            }
        }
        let text = serde_json::to_vec(&done).map_err(|e| CliError::Internal(e.to_string()))?;
        // After a power failure it may not be there, and the job is done again; the images are.
        write_unsynced(&self.of_job(&done.name, ".json"), &text)?;
        Ok(())
    }

    /// The checkpoint of a job with these settings on this scene.
    pub fn checkpoint(&self, job: &Job, scene_hash: &str) -> PathBuf {
        let key = settings(job) + scene_hash;
        let ending = format!(".{:08x}.run", crc32fast::hash(key.as_bytes()));
        self.of_job(&job.name, &ending)
    }

    /// Checkpoints of a job that were there at first, whatever its settings were.
    pub fn checkpoints(&self, name: &str) -> &[PathBuf] {
        let found = self.cut.get(&self.of_job(name, ""));
        found.map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_hold_while_the_file_does() {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("a");
        assert!(Stamp::of(&path).is_none());
        fs::write(&path, "one").expect("written");
        let (stamp, sum) = (
            Stamp::of(&path).expect("there"),
            Stamp::with_sum(&path).expect("there"),
        );
        assert!(stamp.holds() && sum.holds());
        let later = SystemTime::now() + std::time::Duration::from_secs(9);
        let file = fs::File::options().append(true).open(&path).expect("there");
        file.set_modified(later).expect("set");
        assert!(!stamp.holds() && sum.holds());
        assert!(
            Stamp::of(&path)
                .expect("there")
                .younger_than(SystemTime::now())
        );
        fs::write(&path, "two").expect("written");
        assert!(!stamp.holds() && !sum.holds());
        fs::remove_file(&path).expect("there");
        assert!(!sum.holds());
    }

    #[test]
    fn one_batch_at_a_time_has_the_folder() {
        let dir = tempfile::tempdir().expect("a folder");
        let folder = dir.path().join("a.batch");
        let first = Store::open(&folder, dir.path()).expect("free");
        let e = Store::open(&folder, dir.path()).err().expect("taken");
        assert_eq!(e.code(), 2);
        assert!(e.to_string().contains("a.batch: another"), "{e}");
        drop(first);
        Store::open(&folder, dir.path()).expect("free again");
    }

    #[test]
    fn names_of_files_stay_apart() {
        let store = Store::at(Path::new("x"), Path::new(""));
        let names = ["a", "a/b", "a_b", "../a", "", ".", "é", "ü"];
        let files: std::collections::BTreeSet<_> =
            names.iter().map(|n| store.of_job(n, ".json")).collect();
        assert_eq!(files.len(), names.len());
        assert!(
            files
                .iter()
                .all(|f| f.parent() == Some(Path::new("x/jobs")))
        );
        assert_eq!(
            store.of_job("turn.0001", ".json"),
            Path::new("x/jobs/turn.0001.json")
        );
    }

    #[test]
    fn checkpoints_are_found_by_their_job() {
        let dir = tempfile::tempdir().expect("a folder");
        let jobs = dir.path().join("jobs");
        fs::create_dir(&jobs).expect("made");
        for name in [
            "a.00000001.run",
            "a.00000002.run",
            "a.b.00000003.run",
            "a.json",
            ".a.00000001.run.part",
        ] {
            fs::write(jobs.join(name), "").expect("written");
        }
        let store = Store::at(dir.path(), dir.path());
        let count = |name: &str| store.checkpoints(name).len();
        assert_eq!(["a", "a.b", "b"].map(count), [2, 1, 0]);
    }
}
