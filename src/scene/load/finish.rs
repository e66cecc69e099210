//! From what was read to a [`Scene`]: recentred, in f32, without degenerate triangles.

use super::error::{Location, Result, SceneError};
use super::far::{reaches, within};
use super::place::World;
use super::state::{Loader, source};
use crate::scene::geometry::{Geometry, NONE};
use crate::scene::{Light, Scene, Sources};
use glam::{DVec3, Vec3};

/// A smaller lens, beside how far the scene reaches, cannot be told from a pinhole, and densities on it overflow.
const LEAST_LENS: f64 = 1e-12;

impl Loader {
    /// Makes the scene after the last directive.
    pub(super) fn finish(mut self, whole: &Location) -> Result<Scene> {
        self.balanced(0)?;
        if !self.in_world {
            return Err(SceneError::syntax(whole, "the scene has no WorldBegin"));
        }
        if let Some(e) = self.settings.unused() {
            return Err(e);
        }
        let film = self.film()?;
        let (mut camera, eye, exposure) = self.camera(&film)?;
        let settings = self.render_settings(&film, exposure)?;
        let mut world = std::mem::take(&mut self.world);
        let objects = std::mem::take(&mut self.objects).settle(&mut world)?;
        let all = bounds(&world).into_iter().chain(objects.bounds());
        let all = all.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let origin = all.map_or(DVec3::ZERO, corner_of);
        camera.position = (eye - origin).as_vec3();
        let camera_at = self
            .sources
            .camera
            .as_ref()
            .map_or(whole, |c| &c.at)
            .clone();
        within(eye - origin, &camera_at)?;
        for light in &self.lights {
            within(light.position.unwrap_or(origin) - origin, &light.source.at)?;
        }
        reaches(&world, origin)?;
        let mut sources = std::mem::take(&mut self.sources);
        let (mut geometry, mut lights, dropped) = geometry(world, origin, &mut sources, whole)?;
        // How far from the stored origin rays begin and end.
        let lamps = self.lights.iter().filter_map(|l| l.position);
        let far = lamps
            .chain([eye])
            .chain(all.into_iter().flat_map(|b| [b.0, b.1]));
        let reach = far.map(|p| (p - origin).abs().max_element());
        let reach = reach.fold(0.0, f64::max);
        let dropped =
            dropped + objects.finish(&mut geometry, &mut sources, origin, reach, whole)?;
        if dropped > 0 {
            self.warn(
                whole,
                format!("{dropped} triangles without area are left out"),
            );
        }
        if camera.lens_radius > 0.0 && f64::from(camera.lens_radius) < LEAST_LENS * reach {
            let text = format!(
                "a lens of radius {:e} is as good as none",
                camera.lens_radius
            );
            self.warn(&camera_at, text);
            camera.lens_radius = 0.0;
        }
        for pending in std::mem::take(&mut self.lights) {
            let mut light = pending.light;
            if let (Some(p), Light::Point { position, .. } | Light::Spot { position, .. }) =
                (pending.position, &mut light)
            {
                *position = (p - origin).as_vec3();
            }
            lights.push(light);
            sources.lights.push(pending.source);
        }
        if lights.is_empty() {
            self.warn(whole, "the scene has no light");
        }
        let mut files = self.library.files.seen.take();
        files.sort();
        files.dedup();
        let mut scene = Scene {
            geometry,
            materials: self.library.materials,
            images: self.library.images.list,
            lights,
            camera,
            settings,
            origin,
            warnings: self.warnings,
            hash: 0,
            sources,
            files,
        };
        scene.hash = super::hash::scene_hash(&scene);
        Ok(scene)
    }
}

/// A box around everything; `None` around nothing.
pub(super) fn bounds(world: &World) -> Option<(DVec3, DVec3)> {
    let mut lo = DVec3::INFINITY;
    let mut hi = DVec3::NEG_INFINITY;
    for p in world.triangles.iter().flatten() {
        let p = world.positions[*p as usize];
        (lo, hi) = (lo.min(p), hi.max(p));
    }
    for q in &world.quadrics {
        let (c, r) = q.bounds();
        (lo, hi) = (lo.min(c - r), hi.max(c + r));
    }
    (lo.x <= hi.x).then_some((lo, hi))
}

/// The point that is stored as 0: the centre of what lies in the box, rounded to a multiple of a power of two of at least
/// twice its size. What holds or touches the origin stays where it is, and what is taken off is exact in binary.
pub(super) fn corner_of((lo, hi): (DVec3, DVec3)) -> DVec3 {
    let size = (hi - lo).max_element();
    if !(size.is_finite() && size > 0.0) {
        return DVec3::ZERO;
    }
    let step = 2.0 * size.log2().ceil().exp2();
    let origin = (0.5 * (lo + hi) / step).round() * step;
    // −0 is not a point anybody wants to read.
    if origin.is_finite() {
        origin + 0.0
    } else {
        DVec3::ZERO
    }
}

/// What was placed, in f32, without degenerate triangles; the lights of its emissive primitives, and how many triangles
/// were left out.
pub(super) fn geometry(
    world: World,
    origin: DVec3,
    sources: &mut Sources,
    whole: &Location,
) -> Result<(Geometry, Vec<Light>, usize)> {
    let mut positions: Vec<Vec3> = world
        .positions
        .iter()
        .map(|p| (*p - origin).as_vec3())
        .collect();
    if positions.iter().any(|p| !p.is_finite()) {
        return Err(SceneError::value(
            whole,
            "a vertex lies beyond the range of 32-bit floats",
        ));
    }
    let mut g = Geometry::default();
    let mut lights = Vec::new();
    let mut owners = Vec::with_capacity(world.triangle_owner.len() + world.quadric_owner.len());
    for (t, owner) in world.triangles.iter().zip(&world.triangle_owner) {
        let [a, b, c] = t.map(|i| positions[i as usize].as_dvec3());
        if (b - a).cross(c - a) == DVec3::ZERO {
            continue;
        }
        g.triangles.push(*t);
        owners.push(*owner);
    }
    let dropped = world.triangles.len() - g.triangles.len();
    g.quadrics = world.quadrics.iter().map(|q| q.stored(origin)).collect();
    owners.extend(world.quadric_owner);
    for (prim, (shape, emission)) in owners.into_iter().enumerate() {
        g.prim_shape.push(shape);
        if emission == NONE {
            g.prim_light.push(NONE);
            continue;
        }
        let e = &world.emissions[emission as usize];
        g.prim_light.push(lights.len() as u32);
        lights.push(Light::Area {
            prim: prim as u32,
            two_sided: e.two_sided,
            radiance: e.radiance.clone(),
        });
        sources.lights.push(source("area light \"diffuse\"", &e.at));
    }
    // The spare vertex of `Geometry::positions`.
    positions.push(Vec3::ZERO);
    if world.shapes.iter().any(|s| s.has_normals) {
        g.normals = world.normals;
        g.normals.push(Vec3::ZERO);
    }
    if world.shapes.iter().any(|s| s.has_uvs) {
        g.uvs = world.uvs;
        g.uvs.push(glam::Vec2::ZERO);
    }
    g.positions = positions;
    g.shapes = world.shapes;
    sources.shapes = world
        .shape_places
        .iter()
        .map(|(label, at)| source(label.clone(), at))
        .collect();
    Ok((g, lights, dropped))
}
