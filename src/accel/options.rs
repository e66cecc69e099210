//! What can be asked of Embree, and how it refuses.

/// Build qualities of Embree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// Morton order: the quickest build.
    Low,
    /// Binned surface areas.
    Medium,
    /// With spatial splits: the slowest build, and the quickest rays where triangles are long.
    High,
}

/// How to build and trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EmbreeOptions {
    /// Watertight traversal (RTC_SCENE_FLAG_ROBUST).
    pub robust: bool,
    /// Threads of the build; 0 is the library's choice.
    pub threads: usize,
    /// How good a tree to build.
    pub quality: Quality,
    /// Less memory for slower rays (RTC_SCENE_FLAG_COMPACT).
    pub compact: bool,
}

impl Default for EmbreeOptions {
    fn default() -> Self {
        Self {
            robust: true,
            threads: 0,
            quality: Quality::High,
            compact: false,
        }
    }
}

/// Why there is no acceleration structure.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum EmbreeError {
    /// The library made no device.
    #[error("Embree made no device (error code {0})")]
    NoDevice(u32),
    /// The library refused a call; these are its own words.
    #[error("Embree: {0}")]
    Refused(String),
    /// The geometry would make the library read outside its buffers or answer nonsense.
    #[error("geometry not fit for ray tracing: {0}")]
    Geometry(String),
}
