//! A vertex of a path: a place with what is needed to scatter or emit there, whoever made it.

use super::Emitters;
use super::palette::{Palette, emission};
use crate::accel::surface::{facets, uv_again};
use crate::accel::{Surface, dpdu};
use crate::real::{Convert, Real, Vec2, Vec3};
use crate::scatter::{Bsdf, Frame, shade};
use crate::scene::instance::MOST_INSTANCES;
use crate::scene::spectrum::{Lanes, Spectrum};
use crate::scene::{NONE, PrimId, Scene};

/// What kind of place a vertex is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// On a surface; an emitter if `light` is set.
    Surface,
    /// A point or spot light.
    Point,
    /// At infinity: `p` is the unit direction towards it. `light` is the distant light, or [`NONE`] for the sky, which
    /// is all infinite lights together.
    Infinite,
    /// On the lens.
    Lens,
}

/// One vertex, independent of its neighbours on the path.
#[derive(Clone, Copy, Debug)]
pub struct Vertex<const N: usize> {
    /// Position in stored world coordinates; the direction towards it for [`Kind::Infinite`].
    pub p: Vec3,
    /// Bound on the error of each coordinate of `p`.
    pub error: Real,
    /// Unit geometric normal; zero where there is none.
    pub ng: Vec3,
    /// What the vertex is.
    pub kind: Kind,
    /// 1 where there is no surface to be foreshortened (and `ng` is 0), else 0.
    unforeshortened: Real,
    /// Light index, or [`NONE`].
    pub light: u32,
    /// Material index, or [`NONE`].
    pub material: u32,
    /// Primitive of a surface point, in the world or in an object, or [`NONE`].
    prim: u32,
    /// 0, or 1 more than the number of the instance that a surface point is on. Three bytes, which stand where there
    /// were none.
    place: [u8; 3],
    /// [`Surface::at`] of a surface point: with the primitive, all that need be kept of it.
    pub at: Vec2,
    /// Unit shading normal.
    pub ns: Vec3,
    /// First axis of the shading frame, for anisotropic lobes; 0 where any will do.
    pub tangent: Vec3,
    /// Lobes at the path's wavelengths.
    pub bsdf: Bsdf<N>,
    /// What it emits at the path's wavelengths, before the part that depends on the direction: see
    /// [`Emitters::radiance`](super::Emitters::radiance).
    pub emission: Spectrum<N>,
}

impl<const N: usize> Vertex<N> {
    /// A vertex that neither scatters nor lies on a surface.
    pub fn bare(kind: Kind, p: Vec3, ng: Vec3, light: u32) -> Self {
        Self {
            p,
            error: 0.0,
            ng,
            kind,
            unforeshortened: matches!(kind, Kind::Point | Kind::Infinite) as u8 as Real,
            light,
            material: NONE,
            prim: NONE,
            place: [0; 3],
            at: Vec2::ZERO,
            ns: Vec3::ZERO,
            tangent: Vec3::ZERO,
            bsdf: Bsdf::Black,
            emission: Spectrum::ZERO,
        }
    }

    /// A surface point, with its lobes and emission at the wavelengths of `palette`.
    pub fn from_surface(scene: &Scene, prim: PrimId, s: &Surface, palette: &Palette<N>) -> Self {
        let mut v = Self::bare(Kind::Surface, s.p, s.ng, NONE);
        v.become_surface(scene, prim, s, palette);
        v
    }

    /// Becomes what [`Self::from_surface`] would make. Field by field, so that nothing is built elsewhere and copied.
    #[inline(always)]
    pub fn become_surface(
        &mut self,
        scene: &Scene,
        prim: PrimId,
        s: &Surface,
        palette: &Palette<N>,
    ) {
        let geometry = &scene.geometry;
        self.kind = Kind::Surface;
        self.place = [0; 3];
        let (material, light) = match facets(geometry).get(prim.index()) {
            Some(f) => (geometry.shapes[f.shape as usize].material, f.light),
            None => {
                self.place = place(prim);
                geometry.finish(prim)
            }
        };
        self.p = s.p;
        self.error = s.error;
        self.ng = s.ng;
        self.unforeshortened = 0.0;
        self.light = light;
        self.prim = prim.prim();
        self.at = s.at;
        self.ns = s.ns;
        self.emission = palette.emission(scene, light);
        let finish = palette.finish(scene, material, s);
        self.material = finish.material;
        self.bsdf = finish.bsdf;
        self.tangent = if finish.directed {
            Frame::from_normal_tangent(s.ns, dpdu(geometry, prim, s)).x
        } else {
            Vec3::ZERO
        };
    }

    /// The same place at other wavelengths.
    pub fn at_wavelengths(&self, emitters: &Emitters, scene: &Scene, lanes: &Lanes<N>) -> Self {
        if self.kind == Kind::Infinite && self.light == NONE {
            return emitters.sky_vertex(scene, lanes, self.p);
        }
        let mut v = *self;
        if self.kind == Kind::Surface {
            let uv = uv_again(&scene.geometry, self.prim(), self.at);
            v.bsdf = shade(scene, self.material, uv, lanes);
        }
        if self.light != NONE {
            v.emission = emission(scene, self.light, lanes);
        }
        v
    }

    /// Unit direction and 1/distance² to another vertex; distance 1 to a vertex at infinity, so that it drops out.
    /// Vertices at one place are joined by nothing: direction 0 and a geometry term of 0.
    #[inline]
    pub fn towards(&self, other: &Self) -> (Vec3, f64) {
        if other.kind == Kind::Infinite {
            return (other.p, 1.0);
        }
        if self.kind == Kind::Infinite {
            return (-self.p, 1.0);
        }
        let d = other.p - self.p;
        let d2 = d.length_squared();
        if !(1e-30..=1e30).contains(&d2) {
            return far_or_near(d);
        }
        (d * d2.sqrt().recip(), 1.0 / d2 as f64)
    }

    /// Primitive of a surface point, else [`PrimId::NONE`].
    #[inline]
    pub fn prim(&self) -> PrimId {
        match self.place {
            [0, 0, 0] if self.kind != Kind::Surface => PrimId::NONE,
            [0, 0, 0] => PrimId::of(self.prim),
            [a, b, c] => PrimId::through(u32::from_le_bytes([a, b, c, 0]) - 1, self.prim),
        }
    }

    /// The normal that visibility rays leave along; 0 off surfaces.
    #[inline]
    pub fn normal(&self) -> Vec3 {
        if self.kind == Kind::Surface {
            self.ng
        } else {
            Vec3::ZERO
        }
    }

    /// Cosine between a unit direction and the geometric normal; 1 where there is no surface to be foreshortened.
    #[inline]
    pub fn signed_cos(&self, w: Vec3) -> Real {
        self.ng.dot(w) + self.unforeshortened
    }

    /// |cos| between a unit direction and the geometric normal; 1 where there is no surface to be foreshortened.
    #[inline]
    pub fn cos(&self, w: Vec3) -> f64 {
        self.signed_cos(w).abs() as f64
    }

    /// The shading frame of a surface point.
    #[inline]
    pub fn frame(&self) -> Frame {
        if self.tangent == Vec3::ZERO {
            return Frame::from_normal(self.ns);
        }
        Frame {
            x: self.tangent,
            y: self.ns.cross(self.tangent),
            z: self.ns,
        }
    }
}

/// [`Vertex::place`] of a primitive.
#[cold]
fn place(prim: PrimId) -> [u8; 3] {
    let number = prim.instance().map_or(0, |i| i + 1);
    debug_assert!(number <= MOST_INSTANCES);
    let [a, b, c, _] = number.to_le_bytes();
    [a, b, c]
}

/// As [`Vertex::towards`], where f32 does not hold the square of the distance.
#[cold]
fn far_or_near(d: Vec3) -> (Vec3, f64) {
    let d = d.double();
    let d2 = d.length_squared();
    if d2 == 0.0 {
        return (Vec3::ZERO, 0.0);
    }
    ((d / d2.sqrt()).real(), 1.0 / d2)
}
