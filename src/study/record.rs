//! What a study keeps of each image it rendered, and where: one small JSON file and one EXR a point, so that a study that
//! was stopped goes on, and a longer one uses the points of a shorter.

use crate::output::{Image, ImageError, read_image, write_atomic};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// One rendered image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Arguments of `metrolux render` that make it again, without output files.
    pub command: Vec<String>,
    /// Hash of everything in the scene that can change the image.
    pub scene_hash: String,
    /// Rounds, or samples a pixel.
    pub rounds: u64,
    /// Random seed.
    pub seed: u64,
    /// Number of the repeat: points of one number use none of the others' random numbers.
    pub repeat: usize,
    /// Wall time of the rendering, without loading the scene and building the acceleration structure, s.
    pub wall_seconds: f64,
    /// Processor time of all threads in that, s.
    pub cpu_seconds: f64,
    /// Threads.
    pub threads: usize,
    /// Relative error by the image's own account; null where it cannot be told.
    pub claimed: Option<f64>,
    /// Impossible values met (NaN, negative or infinite weights).
    pub faults: u64,
}

impl Point {
    /// Seconds by the clock asked for; processor time is that of a thread.
    pub fn seconds(&self, clock: Clock) -> f64 {
        match clock {
            Clock::Wall => self.wall_seconds,
            Clock::Cpu => self.cpu_seconds / self.threads.max(1) as f64,
        }
    }
}

/// What time is measured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Clock {
    /// The clock on the wall
    Wall,
    /// Processor time over the number of threads: on a machine that others use
    Cpu,
}

impl Clock {
    /// What a number of seconds is called.
    pub fn words(self) -> &'static str {
        match self {
            Self::Wall => "wall time",
            Self::Cpu => "processor time per thread",
        }
    }
}

/// The folder of a study.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

impl Store {
    /// A study's folder, made if it is not there.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn open(folder: &Path) -> Result<Self, ImageError> {
        let store = Self {
            folder: folder.into(),
        };
        let points = folder.join("points");
        std::fs::create_dir_all(&points).map_err(|source| ImageError::NotWritable {
            path: points,
            source,
        })?;
        Ok(store)
    }

    /// A file of the study.
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Where a command's image lies, by a hash of the command and of the scene.
    pub fn image_file(&self, command: &[String], scene_hash: &str) -> PathBuf {
        self.file(&format!("points/{}.exr", key(command, scene_hash)))
    }

    /// The point of a command, if it is done and whole.
    pub fn find(&self, command: &[String], scene_hash: &str) -> Option<(Point, Image)> {
        let image = self.image_file(command, scene_hash);
        let text = std::fs::read(image.with_extension("json")).ok()?;
        let point: Point = serde_json::from_slice(&text).ok()?;
        if point.command != command || point.scene_hash != scene_hash {
            return None;
        }
        Some((point, read_image(&image).ok()?))
    }

    /// Keeps a point whose image is written: with this file it counts as done.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn keep(&self, point: &Point) -> Result<(), ImageError> {
        let image = self.image_file(&point.command, &point.scene_hash);
        self.write_json(&image.with_extension("json"), point)
    }

    /// Writes a value as JSON, whole or not at all.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_json(&self, path: &Path, value: &impl Serialize) -> Result<(), ImageError> {
        let text = serde_json::to_string_pretty(value).expect("plain data");
        write_atomic(path, (text + "\n").as_bytes())
    }

    /// Reads a JSON file of the study; `None` if it is not there or not understood.
    pub fn read_json<T: for<'a> Deserialize<'a>>(&self, name: &str) -> Option<T> {
        serde_json::from_slice(&std::fs::read(self.file(name)).ok()?).ok()
    }
}

/// FNV-1a over the words, each ended by 0.
fn key(command: &[String], scene_hash: &str) -> String {
    let words = command.iter().map(String::as_str).chain([scene_hash]);
    let bytes = words.flat_map(|w| w.bytes().chain([0]));
    let hash = bytes.fold(0xcbf2_9ce4_8422_2325u64, |h, b| {
        (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{Layers, Metadata, write_exr};

    #[test]
    fn a_point_is_found_by_its_command_and_scene_alone() {
        let dir = tempfile::tempdir().expect("a folder");
        let store = Store::open(&dir.path().join("a/b")).expect("made");
        let command = vec!["scene.pbrt".to_owned(), "--rounds".into(), "4".into()];
        let point = Point {
            command: command.clone(),
            scene_hash: "00ff".into(),
            rounds: 4,
            seed: 1,
            repeat: 0,
            wall_seconds: 1.0,
            cpu_seconds: 3.0,
            threads: 2,
            claimed: None,
            faults: 0,
        };
        let image = Image {
            width: 2,
            height: 1,
            rgb: vec![[0.5; 3]; 2],
        };
        let file = store.image_file(&command, "00ff");
        write_exr(&file, &image, &Metadata::default(), Layers::default()).expect("written");
        assert!(
            store.find(&command, "00ff").is_none(),
            "the image alone is not a point"
        );
        store.keep(&point).expect("written");
        assert_eq!(store.find(&command, "00ff"), Some((point.clone(), image)));
        assert!(store.find(&command, "00fe").is_none());
        assert!(store.find(&command[..2], "00ff").is_none());
        std::fs::write(&file, b"cut short").expect("written");
        assert!(store.find(&command, "00ff").is_none());
        assert_eq!(
            (point.seconds(Clock::Wall), point.seconds(Clock::Cpu)),
            (1.0, 1.5)
        );
    }
}
