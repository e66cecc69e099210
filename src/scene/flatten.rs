//! Objects put into the world for good: a copy for every place where they stand; and, to see what instancing costs, the
//! world put behind an instance.

use super::geometry::{Geometry, NONE, Quadric, Shape};
use super::load::{quadric_mesh, uniform_scale};
use super::subset::{keep, renumber};
use super::{Instance, Light, Material, Scene, Source};
use glam::{DAffine3, DVec3, Vec2, Vec3};

/// Puts every place of the objects for which `which` holds into the world.
pub fn flatten(scene: &mut Scene, which: impl Fn(usize) -> bool) {
    let g = &mut scene.geometry;
    let chosen: Vec<bool> = (0..g.objects.len()).map(which).collect();
    if !chosen.contains(&true) {
        return;
    }
    let objects = std::mem::take(&mut g.objects);
    let instances = std::mem::take(&mut g.instances);
    let own = (g.triangles.len(), g.quadrics.len());
    let mut world = Copies::new(g, &mut scene.sources.shapes);
    for i in instances.iter().filter(|i| chosen[i.object as usize]) {
        let object = &objects[i.object as usize];
        let (_, places) = &scene.sources.objects[i.object as usize];
        world.add(object, i, &scene.materials, places);
    }
    world.finish(own, &mut scene.lights);

    // What is left of the objects moves up.
    let mut numbers = Vec::new();
    for (number, object) in objects.into_iter().enumerate() {
        numbers.push(g.objects.len() as u32);
        if !chosen[number] {
            g.objects.push(object);
        }
    }
    let mut keep = chosen.iter().map(|c| !c);
    scene.sources.objects.retain(|_| keep.next() == Some(true));
    let left = instances.into_iter().filter(|i| !chosen[i.object as usize]);
    g.instances = left
        .map(|i| Instance {
            object: numbers[i.object as usize],
            ..i
        })
        .collect();
}

/// A world that objects are copied into.
struct Copies<'a> {
    g: &'a mut Geometry,
    places: &'a mut Vec<Source>,
    /// Shape of each new triangle.
    triangle_shape: Vec<u32>,
    /// Shape of each new quadric.
    quadric_shape: Vec<u32>,
}

impl<'a> Copies<'a> {
    fn new(g: &'a mut Geometry, places: &'a mut Vec<Source>) -> Self {
        // The spare vertex comes back at the end.
        let n = g.positions.len().saturating_sub(1);
        g.positions.truncate(n);
        g.normals.resize(n, Vec3::ZERO);
        g.uvs.resize(n, Vec2::ZERO);
        g.facets.take();
        Self {
            g,
            places,
            triangle_shape: Vec::new(),
            quadric_shape: Vec::new(),
        }
    }

    fn add(
        &mut self,
        object: &Geometry,
        instance: &Instance,
        materials: &[Material],
        places: &[Source],
    ) {
        let (m, mirrored) = (instance.to_world(), instance.mirrors());
        let (cofactors, det) = instance.cofactors();
        let turn = |n: DVec3| (cofactors * n * det.signum()).normalize_or_zero().as_vec3();
        let first_shape = self.g.shapes.len() as u32;
        self.g.shapes.extend(&object.shapes);
        self.places.extend_from_slice(places);
        let uses_uv = |shape: &Shape| {
            let m = materials.get(shape.material as usize);
            m.is_some_and(|m| !m.is_uniform() || m.is_anisotropic())
        };
        // Default coordinates belong to the corners in their order; where that turns and somebody looks they are spelled
        // out, at corners of their own.
        let spelled = |shape: &Shape| mirrored && !shape.has_uvs && uses_uv(shape);
        for (k, shape) in object.shapes.iter().enumerate() {
            let copy = &mut self.g.shapes[first_shape as usize + k];
            copy.has_uvs |= spelled(shape);
        }

        let base = self.g.positions.len() as u32;
        let usable = object.positions.len().saturating_sub(1);
        for (i, p) in object.positions[..usable].iter().enumerate() {
            let normal = object
                .normals
                .get(i)
                .map_or(Vec3::ZERO, |n| turn(n.as_dvec3()));
            let uv = object.uvs.get(i).copied().unwrap_or(Vec2::ZERO);
            self.vertex(m.transform_point3(p.as_dvec3()), normal, uv);
        }
        for (t, &shape) in object.triangles.iter().zip(&object.prim_shape) {
            let mut t = t.map(|i| base + i);
            if spelled(&object.shapes[shape as usize]) {
                let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE];
                t = std::array::from_fn(|c| {
                    let i = t[c] as usize;
                    let (p, n) = (self.g.positions[i], self.g.normals[i]);
                    self.vertex(p.as_dvec3(), n, corners[c])
                });
            }
            self.triangle(t, mirrored, first_shape + shape);
        }
        for (q, &shape) in object
            .quadrics
            .iter()
            .zip(&object.prim_shape[object.triangles.len()..])
        {
            let turned_uv = mirrored && uses_uv(&object.shapes[shape as usize]);
            match quadric(q, &m, turned_uv) {
                Some(q) => {
                    self.g.quadrics.push(q);
                    self.quadric_shape.push(first_shape + shape);
                }
                None => {
                    let shape = first_shape + shape;
                    self.tessellated(q, &m, shape, mirrored, &turn);
                }
            }
        }
    }

    /// A quadric that does not keep its form, as a fine mesh.
    fn tessellated(
        &mut self,
        q: &Quadric,
        m: &DAffine3,
        shape: u32,
        mirrored: bool,
        turn: &impl Fn(DVec3) -> Vec3,
    ) {
        let mesh = quadric_mesh(q);
        let new = Shape {
            has_normals: !mesh.normals.is_empty(),
            has_uvs: true,
            ..self.g.shapes[shape as usize]
        };
        self.g.shapes.push(new);
        self.places.push(self.places[shape as usize].clone());
        let shape = self.g.shapes.len() as u32 - 1;
        let base = self.g.positions.len() as u32;
        for (i, p) in mesh.positions.iter().enumerate() {
            let normal = mesh.normals.get(i).map_or(Vec3::ZERO, |n| turn(*n));
            self.vertex(m.transform_point3(*p), normal, mesh.uvs[i]);
        }
        for t in &mesh.triangles {
            self.triangle(t.map(|i| base + i), mirrored, shape);
        }
    }

    fn vertex(&mut self, p: DVec3, normal: Vec3, uv: Vec2) -> u32 {
        self.g.positions.push(p.as_vec3());
        self.g.normals.push(normal);
        self.g.uvs.push(uv);
        self.g.positions.len() as u32 - 1
    }

    /// Triangles that have lost their area on the way are left out.
    fn triangle(&mut self, [a, b, c]: [u32; 3], mirrored: bool, shape: u32) {
        let [p, q, r] = [a, b, c].map(|i| self.g.positions[i as usize].as_dvec3());
        if (q - p).cross(r - p) == DVec3::ZERO {
            return;
        }
        self.g
            .triangles
            .push(if mirrored { [a, c, b] } else { [a, b, c] });
        self.triangle_shape.push(shape);
    }

    /// New triangles stand behind the old ones and before all quadrics, whose numbers rise.
    fn finish(self, (triangles, quadrics): (usize, usize), lights: &mut [Light]) {
        let added = self.triangle_shape.len();
        let shapes = &mut self.g.prim_shape;
        shapes.splice(triangles..triangles, self.triangle_shape);
        shapes.extend(self.quadric_shape);
        let emits = &mut self.g.prim_light;
        emits.splice(triangles..triangles, std::iter::repeat_n(NONE, added));
        emits.resize(shapes.len(), NONE);
        for light in lights {
            if let Light::Area { prim, .. } = light
                && (triangles..triangles + quadrics).contains(&(*prim as usize))
            {
                *prim += added as u32;
            }
        }
        self.g.positions.push(Vec3::ZERO);
        self.g.normals.push(Vec3::ZERO);
        self.g.uvs.push(Vec2::ZERO);
        if !self.g.shapes.iter().any(|s| s.has_normals) {
            self.g.normals = Vec::new();
        }
        if !self.g.shapes.iter().any(|s| s.has_uvs) {
            self.g.uvs = Vec::new();
        }
    }
}

/// The quadric under a map, if it stays one; `turned_uv`: the map mirrors, and somebody looks which way φ turns.
fn quadric(q: &Quadric, m: &DAffine3, turned_uv: bool) -> Option<Quadric> {
    match *q {
        Quadric::Sphere {
            center,
            radius,
            to_object,
            inward,
        } => {
            let s = uniform_scale(&(*m).into())?;
            let back = (m.matrix3.transpose() * (1.0 / s)).as_mat3();
            Some(Quadric::Sphere {
                center: m.transform_point3(center.as_dvec3()).as_vec3(),
                radius: (radius as f64 * s) as f32,
                to_object: to_object * back,
                inward,
            })
        }
        Quadric::Disk {
            center,
            normal,
            tangent,
            radius,
        } => {
            let (n, t) = (normal.as_dvec3(), tangent.as_dvec3());
            let (x, y) = (m.matrix3 * t, m.matrix3 * n.cross(t));
            let (lx, ly) = (x.length(), y.length());
            let round = (lx - ly).abs() <= 1e-5 * lx && x.dot(y).abs() <= 1e-5 * lx * ly;
            let side = 1f64.copysign(m.matrix3.determinant());
            (round && !turned_uv).then(|| Quadric::Disk {
                center: m.transform_point3(center.as_dvec3()).as_vec3(),
                normal: (x.cross(y).normalize() * side).as_vec3(),
                tangent: (x / lx).as_vec3(),
                radius: (radius as f64 * 0.5 * (lx + ly)) as f32,
            })
        }
    }
}

/// Puts all that does not emit behind an instance that leaves it where it is. The image stays the same.
pub fn put_behind(scene: &mut Scene) {
    let reach = scene.reach();
    let g = &mut scene.geometry;
    let mut object = g.clone();
    (object.objects, object.instances) = (Vec::new(), Vec::new());
    object.facets.take();
    g.facets.take();
    let dark: Vec<bool> = g.prim_light.iter().map(|l| *l == NONE).collect();
    keep(&mut object, |prim| dark[prim]);
    keep(g, |prim| !dark[prim]);
    renumber(&mut scene.lights, g);
    let Some((lo, hi)) = object.bounds() else {
        return;
    };
    let radius = lo.abs().max(hi.abs()).max_element() as f64;
    let number = g.objects.len() as u32;
    let instance = Instance::new(number, &DAffine3::IDENTITY, radius, reach);
    g.instances.push(instance.expect("nothing moves"));
    g.objects.push(object);
    let shapes = scene.sources.shapes.clone();
    let of = shapes.first().cloned();
    let source = of.unwrap_or_else(|| Source::unknown("the world"));
    scene.sources.objects.push((source, shapes));
}
