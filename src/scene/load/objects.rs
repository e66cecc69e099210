//! Objects and the places where they stand. One that stands in a single place becomes a part of the world; the others
//! are kept once, in a space of their own.

use super::error::{Location, Result, SceneError};
use super::finish::{bounds, corner_of, geometry};
use super::place::{Placeable, World};
use super::state::source;
use crate::scene::geometry::Geometry;
use crate::scene::instance::MOST_INSTANCES;
use crate::scene::{Instance, Source, Sources};
use glam::{DAffine3, DMat4, DVec3};
use std::collections::HashMap;

/// What stands between `ObjectBegin` and `ObjectEnd`.
#[derive(Debug)]
pub(super) struct Definition {
    pub(super) name: String,
    pub(super) at: Location,
    pub(super) shapes: Vec<Placeable>,
}

/// All objects, and where they stand.
#[derive(Default)]
pub(super) struct Objects {
    names: HashMap<String, u32>,
    definitions: Vec<Definition>,
    /// Object and transform of each `ObjectInstance`.
    places: Vec<(u32, DAffine3)>,
}

/// Objects that are instanced, before the scene's origin is known.
pub(super) struct Instanced {
    parts: Vec<Part>,
    /// Part and transform.
    places: Vec<(u32, DAffine3)>,
}

struct Part {
    world: World,
    bounds: (DVec3, DVec3),
    source: Source,
}

impl Objects {
    pub(super) fn knows(&self, name: &str) -> bool {
        self.names.contains_key(name)
    }

    pub(super) fn define(&mut self, object: Definition) {
        let number = self.definitions.len() as u32;
        self.names.insert(object.name.clone(), number);
        self.definitions.push(object);
    }

    /// Lets a known object stand somewhere.
    pub(super) fn place(&mut self, name: &str, ctm: &DMat4, at: &Location) -> Result<()> {
        let number = self.names[name];
        let overflows = |s: &Placeable| !(*ctm * s.to_world).is_finite();
        if self.definitions[number as usize]
            .shapes
            .iter()
            .any(overflows)
        {
            return Err(SceneError::value(at, "the transform overflows"));
        }
        if self.places.len() >= MOST_INSTANCES as usize {
            return Err(SceneError::value(at, "too many instances")
                .expected(format!("at most {MOST_INSTANCES}")));
        }
        self.places.push((number, DAffine3::from_mat4(*ctm)));
        Ok(())
    }

    /// Puts into the world what stands there once, and what f32 could not carry rays to; leaves the rest.
    pub(super) fn settle(self, world: &mut World) -> Result<Instanced> {
        let Self {
            definitions,
            mut places,
            ..
        } = self;
        let mut uses = vec![0usize; definitions.len()];
        for (number, _) in &places {
            uses[*number as usize] += 1;
        }
        let mut placed = Ok(());
        places.retain(|(number, to_world)| {
            let number = *number as usize;
            let stays = uses[number] > 1 && Instance::carries(&to_world.matrix3);
            if !stays && placed.is_ok() {
                let mut shapes = definitions[number].shapes.iter();
                placed = shapes.try_for_each(|s| world.place(s, Some(&(*to_world).into())));
            }
            stays
        });
        placed?;
        // Objects that stand nowhere any more are left out.
        let mut numbers = vec![None; definitions.len()];
        for (number, _) in &places {
            numbers[*number as usize] = Some(0);
        }
        let mut parts = Vec::new();
        for (number, object) in numbers.iter_mut().zip(definitions) {
            if number.is_none() {
                continue;
            }
            let mut world = World::default();
            for s in &object.shapes {
                world.place(s, None)?;
            }
            *number = bounds(&world).map(|bounds| {
                let source = source(format!("object \"{}\"", object.name), &object.at);
                parts.push(Part {
                    world,
                    bounds,
                    source,
                });
                parts.len() as u32 - 1
            });
        }
        places.retain_mut(|(number, _)| match numbers[*number as usize] {
            Some(part) => {
                *number = part;
                true
            }
            // Nothing in it can be seen.
            None => false,
        });
        Ok(Instanced { parts, places })
    }
}

impl Instanced {
    /// The box of each place, in true world coordinates.
    pub(super) fn bounds(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        self.places.iter().map(|(part, to_world)| {
            let (lo, hi) = self.parts[*part as usize].bounds;
            let (c, e) = (0.5 * (lo + hi), 0.5 * (hi - lo));
            let c = to_world.transform_point3(c);
            let e = magnitudes(to_world) * e;
            (c - e, c + e)
        })
    }

    /// Puts objects and instances into the geometry of a world whose stored coordinates begin at `origin` and reach as far
    /// as `reach`. Returns how many triangles without area were left out.
    pub(super) fn finish(
        self,
        g: &mut Geometry,
        sources: &mut Sources,
        origin: DVec3,
        reach: f64,
        whole: &Location,
    ) -> Result<usize> {
        let mut dropped = 0;
        let mut own = Vec::new();
        for part in self.parts {
            // An object keeps its digits as the world does, wherever its own space puts it.
            let center = corner_of(part.bounds);
            let mut of_object = Sources::default();
            let (object, _, left_out) = geometry(part.world, center, &mut of_object, whole)?;
            dropped += left_out;
            let (lo, hi) = part.bounds;
            let size = (lo - center).abs().max((hi - center).abs());
            own.push((center, size, part.source.clone()));
            sources.objects.push((part.source, of_object.shapes));
            g.objects.push(object);
        }
        for (part, to_world) in self.places {
            let (center, size, source) = &own[part as usize];
            let mut m = to_world;
            m.translation = m.transform_point3(*center) - origin;
            let radius = (magnitudes(&m) * *size).max_element();
            let Some(instance) = Instance::new(part, &m, radius, reach) else {
                let text = format!(
                    "an instance of {} is too small beside the scene",
                    source.label
                );
                return Err(SceneError::value(&source.at, text));
            };
            g.instances.push(instance);
        }
        Ok(dropped)
    }
}

/// The linear part with its entries' magnitudes.
fn magnitudes(m: &DAffine3) -> glam::DMat3 {
    let m = &m.matrix3;
    glam::DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}
