//! Where the things of a scene stand in its files.

use super::load::Location;
use std::fmt;
use std::sync::Arc;

/// Something of the scene, by name and place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// What it is, as the file names it: `dielectric "Glass"`.
    pub label: Arc<str>,
    /// Where it is declared.
    pub at: Location,
}

impl Source {
    /// Of something that stands in no file.
    pub fn unknown(label: &str) -> Self {
        Self {
            label: label.into(),
            at: Location {
                file: "".into(),
                line: 0,
                column: 0,
            },
        }
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.label, self.at)
    }
}

/// The sources of a scene's parts, each list parallel to the list it is named after.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sources {
    /// Parallel to `Scene::materials`.
    pub materials: Vec<Source>,
    /// Parallel to `Geometry::shapes`.
    pub shapes: Vec<Source>,
    /// Parallel to `Geometry::objects`: the object, and the shapes of its geometry.
    pub objects: Vec<(Source, Vec<Source>)>,
    /// Parallel to `Scene::lights`.
    pub lights: Vec<Source>,
    /// The camera, if the file has one.
    pub camera: Option<Source>,
    /// The integrator, if the file has one.
    pub integrator: Option<Source>,
}
