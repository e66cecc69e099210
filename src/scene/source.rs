//! Where the things of a scene stand in its files.

use super::PrimId;
use super::geometry::Geometry;
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

impl Sources {
    /// The shape that a primitive is part of.
    pub fn surface(&self, geometry: &Geometry, id: PrimId) -> String {
        let (instance, part, prim) = geometry.resolve(id);
        let shape = part.prim_shape[prim as usize] as usize;
        let shapes = instance.map_or(Some(self.shapes.as_slice()), |i| {
            let object = self.objects.get(i.object as usize)?;
            Some(object.1.as_slice())
        });
        let source = shapes.and_then(|s| s.get(shape));
        source.map_or_else(|| "a shape".into(), Source::to_string)
    }
}
