//! Errors of the command line, each with its exit code (the one place that derives them).

use super::compare::CompareError;
use crate::accel::EmbreeError;
use crate::output::ImageError;
use crate::scene::load::SceneError;
use std::path::Path;
use std::process::ExitCode;

/// Why a command could not do its work.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// The scene cannot be read or does not make sense.
    #[error("{0}")]
    Scene(#[from] SceneError),
    /// Options that do not go together.
    #[error("{0}")]
    Usage(String),
    /// An image could not be read or written.
    #[error("{0}")]
    Output(#[from] ImageError),
    /// The ray-tracing backend refused.
    #[error("{0}")]
    Accel(#[from] EmbreeError),
    /// A comparison did not come about.
    #[error("{0}")]
    Compare(#[from] CompareError),
    /// Stdout takes no more.
    #[error("cannot print: {0}")]
    Stdout(std::io::Error),
    /// An interrupt before there was a result; what is done is kept.
    #[error("{0}")]
    Stopped(String),
    /// A fault of this program or of the system.
    #[error("{0}")]
    Internal(String),
}

impl CliError {
    /// 1 internal · 2 usage, scene or unreadable input · 4 output not writable · 75 interrupted.
    pub fn code(&self) -> u8 {
        match self {
            Self::Scene(_) | Self::Usage(_) | Self::Accel(EmbreeError::Geometry(_)) => 2,
            Self::Output(e) => e.exit_code(),
            Self::Compare(e) => e.exit_code(),
            Self::Stdout(_) => 4,
            Self::Stopped(_) => 75,
            Self::Accel(_) | Self::Internal(_) => 1,
        }
    }

    /// That a file cannot be written.
    pub fn not_writable(path: &Path, source: std::io::Error) -> Self {
        let path = path.into();
        Self::Output(ImageError::NotWritable { path, source })
    }

    /// [`Self::code`] as the process returns it.
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(self.code())
    }
}
