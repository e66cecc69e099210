//! Shapes that no path can meet, as far as that is certain without rays.
//!
//! Where light scatters once at most, a path is a camera ray and a way from its end to a light. Both lie in every half-space
//! that holds the lens, all directions of its rays, and all lights; a shape outside one of these takes no part. The
//! half-spaces asked are those in front of the lens and, of a pinhole, behind each side of the image. Light that comes from
//! everywhere or scatters again may reach any place: then nothing is certain, and every shape counts as taking part.

use super::reach::box_corners;
use crate::scene::{Camera, Geometry, Light, NONE, Quadric, Scene};
use glam::{DVec3, Vec3};

/// How far outside a shape must be, over the largest coordinate: some hundred roundings, of which a ray's end, its
/// direction and the plane have a few each.
const MARGIN: f64 = 1e-5;

/// All points x with n·(x − p) ≥ 0.
struct HalfSpace {
    p: DVec3,
    /// Of length 1.
    n: DVec3,
}

impl HalfSpace {
    fn height(&self, x: Vec3) -> f64 {
        self.n.dot(x.as_dvec3() - self.p)
    }

    /// Least and greatest height of a primitive, or a little less and more.
    fn span(&self, g: &Geometry, prim: u32) -> (f64, f64) {
        let of = |points: &[Vec3]| {
            let heights = points.iter().map(|x| self.height(*x));
            heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), h| {
                (lo.min(h), hi.max(h))
            })
        };
        match g.quadric(prim) {
            None => of(&g.corners(prim)),
            Some(Quadric::Sphere { center, radius, .. }) => {
                let (h, r) = (self.height(*center), *radius as f64);
                (h - r, h + r)
            }
            Some(Quadric::Disk { .. }) => {
                let (lo, hi) = g.prim_bounds(prim);
                of(&box_corners(lo, hi))
            }
        }
    }

    /// Whether all of a light is inside. Lights at infinity are not: the disk that their power is counted on holds all
    /// shapes, so that leaving one out would change how often they are chosen.
    fn holds(&self, light: &Light, g: &Geometry) -> bool {
        match light {
            Light::Area { prim, .. } => self.span(g, *prim).0 >= 0.0,
            Light::Point { position, .. } | Light::Spot { position, .. } => {
                self.height(*position) >= 0.0
            }
            Light::Distant { .. }
            | Light::InfiniteConstant { .. }
            | Light::InfiniteImage { .. } => false,
        }
    }
}

/// For each shape of the world, whether no path can meet it; `lit` tells the lights that take part.
pub fn unseen_shapes(scene: &Scene, lit: &[bool]) -> Vec<bool> {
    let g = &scene.geometry;
    let mut unseen = vec![false; g.shapes.len()];
    if scene.settings.max_depth > 1 {
        return unseen;
    }
    let mut spaces = around(&scene.camera, scene.settings.filter.radius);
    for (light, _) in scene.lights.iter().zip(lit).filter(|l| *l.1) {
        spaces.retain(|s| s.holds(light, g));
    }
    let margin = MARGIN * scene.reach();
    let outside = |prim: u32| {
        // A lamp stays, lit or not: lights are known by their primitives.
        let dark = g.prim_light[prim as usize] == NONE;
        dark && spaces.iter().any(|s| s.span(g, prim).1 < -margin)
    };
    let mut met = vec![false; g.shapes.len()];
    for (prim, shape) in g.prim_shape.iter().enumerate() {
        let gone = outside(prim as u32);
        let shape = *shape as usize;
        unseen[shape] = gone && !met[shape];
        met[shape] |= !gone;
    }
    unseen
}

/// The half-spaces that hold the lens and all its rays. The image is wider than its window by what the pixel
/// filter reaches beyond a pixel.
fn around(c: &Camera, filter: [f32; 2]) -> Vec<HalfSpace> {
    let p = c.position.as_dvec3();
    let [right, up, forward] = [c.axes.x_axis, c.axes.y_axis, c.axes.z_axis].map(|a| a.as_dvec3());
    let mut normals = vec![forward];
    if c.lens_radius <= 0.0 {
        let [x0, x1, y0, y1] = c.screen.map(f64::from);
        let wider = |lo: f64, hi: f64, axis: usize| {
            // A pixel reaches half a pixel from its centre by itself.
            let pixels = (f64::from(filter[axis]) - 0.5).max(0.0);
            let more = (hi - lo) * pixels / f64::from(c.resolution[axis].max(1));
            (lo - more, hi + more)
        };
        let ((x0, x1), (y0, y1)) = (wider(x0, x1, 0), wider(y0, y1, 1));
        normals.extend([
            right - forward * x0,
            forward * x1 - right,
            up - forward * y0,
            forward * y1 - up,
        ]);
    }
    let space = |n: DVec3| HalfSpace {
        p,
        n: n.normalize(),
    };
    normals.into_iter().map(space).collect()
}
