//! The lens: raster points to rays and back, W_e and its densities.
//!
//! The raster domain is the crop dilated by the filter's radius. W_e is normalised so that W_e·cosθ·dω·dA_lens = dr with
//! r the raster point in pixels: ∫ f over paths is radiance integrated over the raster domain.

use super::{Kind, Vertex};
use crate::real::{Convert, Real, Vec2, Vec3};
use crate::sampling::warp;
use crate::scene::{Camera, FilterSettings, NONE};

/// r1: the smallest distance a lens perturbation moves a raster point, pixels (Veach 11.4.3.1).
const R1: Real = 0.1;
/// π·r2² as part of the image.
const R2_AREA: Real = 0.05;

/// A camera made ready for light transport.
#[derive(Clone, Debug)]
pub struct Lens {
    position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    /// Pixels per unit length on the plane z = 1, x and y.
    pixels: Vec2,
    /// 1 / `pixels`.
    per_pixel: Vec2,
    /// Raster point = (x, y on z = 1 from the window's corner) · pixels.
    corner: Vec2,
    radius: Real,
    focal: Real,
    /// Lower corner of the raster domain, pixels.
    pub lo: Vec2,
    /// Upper corner of the raster domain, pixels.
    pub hi: Vec2,
    /// Area of the raster domain, px².
    pub raster_area: f64,
    /// r2: the largest distance a lens perturbation moves a raster point, pixels.
    pub perturbation: Real,
    /// ln(r2/r1).
    pub perturbation_range: Real,
}

impl Lens {
    /// Prepares a camera whose pixels have the given filter.
    pub fn new(c: &Camera, filter: &FilterSettings) -> Self {
        let [x0, x1, y0, y1] = c.screen.real();
        let res = Vec2::new(c.resolution[0] as Real, c.resolution[1] as Real);
        let r = Vec2::from_array(filter.radius.real());
        let lo =
            Vec2::new(c.crop[0] as Real + 0.5, c.crop[1] as Real + 0.5) - r.max(Vec2::splat(0.5));
        let hi =
            Vec2::new(c.crop[2] as Real - 0.5, c.crop[3] as Real - 0.5) + r.max(Vec2::splat(0.5));
        let r2 = (R2_AREA * res.element_product() / crate::real::consts::PI).sqrt();
        Self {
            position: c.position.real(),
            right: c.axes.x_axis.real(),
            up: c.axes.y_axis.real(),
            forward: c.axes.z_axis.real(),
            pixels: res / Vec2::new(x1 - x0, y1 - y0),
            per_pixel: Vec2::new(x1 - x0, y1 - y0) / res,
            corner: Vec2::new(x0, y1),
            radius: c.lens_radius.real(),
            focal: c.focal_distance.real(),
            lo,
            hi,
            raster_area: (hi - lo).double().element_product(),
            perturbation: r2,
            perturbation_range: (r2 / R1).max(1.0).ln(),
        }
    }

    /// The aperture has an area.
    pub fn has_aperture(&self) -> bool {
        self.radius > 0.0
    }

    /// Uniform point of the raster domain.
    #[inline]
    pub fn sample_raster(&self, u: Vec2) -> Vec2 {
        self.lo + u * (self.hi - self.lo)
    }

    /// The raster point lies in the domain.
    #[inline]
    pub fn contains(&self, r: Vec2) -> bool {
        r.x >= self.lo.x && r.y >= self.lo.y && r.x < self.hi.x && r.y < self.hi.y
    }

    /// A vertex on the lens, uniform over the aperture.
    #[inline]
    pub fn sample_vertex<const N: usize>(&self, u: Vec2) -> Vertex<N> {
        let d = if self.radius > 0.0 {
            warp::disk(u) * self.radius
        } else {
            Vec2::ZERO
        };
        self.vertex(self.position + self.right * d.x + self.up * d.y)
    }

    /// The vertex at a point of the lens.
    #[inline]
    pub fn vertex<const N: usize>(&self, p: Vec3) -> Vertex<N> {
        Vertex::bare(Kind::Lens, p, self.forward, NONE)
    }

    /// Density of [`Self::sample_vertex`] per unit lens area; 1 for a pinhole, whose delta cancels with that of W_e.
    #[inline]
    pub fn pdf_vertex(&self) -> f64 {
        if self.radius > 0.0 {
            1.0 / (std::f64::consts::PI * (self.radius as f64).powi(2))
        } else {
            1.0
        }
    }

    /// The vertex at which a light ray from `o` in unit direction `w` passes the aperture into the camera, its raster point
    /// in the domain. The lens is no surface of the scene: it stops nothing, and what lies before it is not asked here.
    #[inline]
    pub fn crossing<const N: usize>(&self, o: Vec3, w: Vec3) -> Option<Vertex<N>> {
        let z = w.dot(self.forward);
        let from = o - self.position;
        let height = from.dot(self.forward);
        if z >= 0.0 || height <= 0.0 {
            return None;
        }
        let on_plane = from - w * (height / z);
        let d = Vec2::new(on_plane.dot(self.right), on_plane.dot(self.up));
        if d.length_squared() > self.radius * self.radius {
            return None;
        }
        let p = self.position + self.right * d.x + self.up * d.y;
        self.contains(self.raster(p, -w)?)
            .then(|| Vertex::bare(Kind::Lens, p, self.forward, NONE))
    }

    /// Unit direction into the scene from the lens point `x` for a raster point.
    #[inline]
    pub fn direction(&self, x: Vec3, r: Vec2) -> Vec3 {
        let s = r * self.per_pixel;
        let (px, py) = (self.corner.x + s.x, self.corner.y - s.y);
        let focus = self.right * px + self.up * py + self.forward;
        if self.radius > 0.0 {
            (focus * self.focal - (x - self.position)).normalize()
        } else {
            focus.normalize()
        }
    }

    /// Raster point (possibly outside the domain) seen from lens point `x` in unit direction `w`; `None` behind.
    #[inline]
    pub fn raster(&self, x: Vec3, w: Vec3) -> Option<Vec2> {
        let z = w.dot(self.forward);
        if z <= 0.0 {
            return None;
        }
        let mut q = Vec2::new(w.dot(self.right), w.dot(self.up)) / z;
        if self.radius > 0.0 {
            let o = x - self.position;
            q += Vec2::new(o.dot(self.right), o.dot(self.up)) / self.focal;
        }
        Some(Vec2::new(q.x - self.corner.x, self.corner.y - q.y) * self.pixels)
    }

    /// dr/dω in px²/sr for a unit direction with cosine `cos` to the axis.
    #[inline]
    pub fn raster_per_solid_angle(&self, cos: f64) -> f64 {
        (self.pixels.x as f64 * self.pixels.y as f64) / (cos * cos * cos)
    }

    /// W_e for a unit direction with cosine `cos` to the axis, per unit lens area (delta dropped for a pinhole).
    #[inline]
    pub fn importance(&self, cos: f64) -> f64 {
        self.raster_per_solid_angle(cos) / cos * self.pdf_vertex()
    }
}
