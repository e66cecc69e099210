//! Errors of reading and writing images, grouped by whose fault they are.

use std::path::PathBuf;

/// Why an image could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The output cannot be written: full disk, missing folder, no permission.
    #[error("{path}: cannot be written: {source}")]
    NotWritable {
        /// The output.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The input cannot be opened or read.
    #[error("{path}: cannot be read: {source}")]
    NotReadable {
        /// The input.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The input's content is not an image we understand.
    #[error("{path}: {reason}")]
    Bad {
        /// The input.
        path: PathBuf,
        /// What was found and what was expected.
        reason: String,
    },
    /// The input claims more pixels than we decode.
    #[error("{path}: claims {width}×{height} pixels, more than the {limit} that are read")]
    TooLarge {
        /// The input.
        path: PathBuf,
        /// Claimed width.
        width: u64,
        /// Claimed height.
        height: u64,
        /// Most pixels.
        limit: u64,
    },
}

impl ImageError {
    /// The process exit code this leads to: 4 output not writable, 2 bad input.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::NotWritable { .. } => 4,
            Self::NotReadable { .. } | Self::Bad { .. } | Self::TooLarge { .. } => 2,
        }
    }

    /// Refuses sizes that are empty or too large, before anything is allocated.
    pub(super) fn check_size(path: &std::path::Path, width: u64, height: u64) -> Result<(), Self> {
        if width == 0 || height == 0 {
            return Err(Self::Bad {
                path: path.into(),
                reason: "the image has no pixels".into(),
            });
        }
        let limit = super::MOST_PIXELS;
        match width.checked_mul(height) {
            Some(n) if n <= limit => Ok(()),
            _ => Err(Self::TooLarge {
                path: path.into(),
                width,
                height,
                limit,
            }),
        }
    }
}
