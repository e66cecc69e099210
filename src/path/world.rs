//! What every path of a render shares.

use super::{Emitters, Kind, Lens, Sites, Start, Tally, Vertex};
use crate::accel::surface::is_sliver;
use crate::accel::{Accel, Ray, offset_origin, visible, visible_but};
use crate::plan::{Effect, Plan};
use crate::real::{Convert, Real, Vec3};
use crate::scene::spectrum::{Grey, Lanes, Target};
use crate::scene::{Material, PrimId, Scene};

/// Leaves out no primitive.
const NOTHING: [PrimId; 2] = [PrimId::NONE; 2];

/// A scene made ready for light transport on a backend.
pub struct World<'a, A: Accel> {
    /// The scene.
    pub scene: &'a Scene,
    /// Who answers rays.
    pub accel: &'a A,
    /// Its lights.
    pub emitters: Emitters,
    /// Its camera.
    pub lens: Lens,
    /// Some material bends light by its wavelength.
    pub dispersive: bool,
    /// Most edges of a path.
    pub max_edges: usize,
    /// What the target τ of every path is made of.
    pub target: Target,
    /// The one wavelength that all paths carry, in a scene without colour.
    pub grey: Option<Grey>,
    /// Where impossible values were met.
    pub sites: Sites,
}

/// Directions with a smaller cosine to the normal leave a surface as [`World::leave`] has it, whatever they are for.
const LEAST_COSINE: Real = 1.0 / 64.0;

impl<'a, A: Accel> World<'a, A> {
    /// Prepares a scene. A path has at most `max_depth + 1` edges.
    pub fn new(scene: &'a Scene, accel: &'a A, max_depth: u32) -> Self {
        Self {
            scene,
            accel,
            emitters: Emitters::new(scene),
            lens: Lens::new(&scene.camera, &scene.settings.filter),
            dispersive: scene.materials.iter().any(Material::is_dispersive),
            max_edges: max_depth as usize + 1,
            target: Target::default(),
            grey: None,
            sites: Sites::default(),
        }
    }

    /// The same as a plan of the scene has it: without the lights that give nothing, and without what nothing calls for.
    pub fn with_plan(self, plan: &Plan) -> Self {
        Self {
            emitters: Emitters::among(self.scene, |i| plan.lit[i], plan.power.clone()),
            dispersive: plan.on(Effect::Dispersion),
            grey: plan.grey.as_ref().map(|g| g.1),
            ..self
        }
    }

    /// The same with another target.
    pub fn with_target(self, target: Target) -> Self {
        Self { target, ..self }
    }

    /// The lanes of hero variable `u`, with the target of this render.
    #[inline]
    pub fn lanes<const N: usize>(&self, u: Real) -> Lanes<N> {
        match &self.grey {
            None => Lanes::with(u, self.target),
            Some(grey) => grey.lanes(self.target),
        }
    }

    /// Where a ray begins that leaves `x` in direction `w`; `at` where `x` is on no surface.
    #[inline]
    pub fn leave<const N: usize>(&self, x: &Vertex<N>, at: Vec3, w: Vec3) -> Start {
        if x.kind != Kind::Surface {
            return Start::at(at);
        }
        Start {
            o: offset_origin(x.p, x.error, x.ng, w),
            off: self.off(x),
        }
    }

    /// As [`Self::leave`] of a surface point, but on the line through `x` itself: what the ray meets is seen from `x` in
    /// direction `w` to rounding, which goes either way. A ray that begins beside `x` meets what lies a little towards
    /// the normal; where each direction is made of the last one, that adds up, and the smaller the turns the less else
    /// there is against it. Next to the surface, where the line would begin far off, the origin is as ever.
    #[inline]
    pub fn leave_on_line<const N: usize>(&self, x: &Vertex<N>, w: Vec3) -> Start {
        let beside = self.leave(x, x.p, w);
        let (up, cos) = ((beside.o - x.p).dot(x.ng), w.dot(x.ng));
        if x.kind != Kind::Surface || cos.abs() < LEAST_COSINE {
            return beside;
        }
        Start {
            o: x.p + w * (up / cos),
            ..beside
        }
    }

    /// The primitive that rays from and to `x` leave out, if they do.
    #[inline]
    fn off<const N: usize>(&self, x: &Vertex<N>) -> PrimId {
        if self.scene.geometry.leave_out {
            self.sliver(x)
        } else {
            PrimId::NONE
        }
    }

    #[inline(never)]
    fn sliver<const N: usize>(&self, x: &Vertex<N>) -> PrimId {
        let id = x.prim();
        if id != PrimId::NONE && is_sliver(&self.scene.geometry, id) {
            id
        } else {
            PrimId::NONE
        }
    }

    /// The lens vertex that a light ray from `x` in unit direction `w`, leaving at `o`, reaches: the last vertex of the
    /// strategy t = 0. A ray from infinity does not go straight to the lens, since the disk that such rays are sent
    /// through covers the scene and need not cover the camera; [`Path`](super::Path) knows that density as 0.
    #[cold]
    pub fn reach_lens<const N: usize>(
        &self,
        x: &Vertex<N>,
        o: Vec3,
        w: Vec3,
        tally: &mut Tally,
    ) -> Option<Vertex<N>> {
        if x.kind == Kind::Infinite {
            return None;
        }
        let lens = self.lens.crossing(o, w)?;
        self.visible(x, &lens, tally).then_some(lens)
    }

    /// Two vertices see each other.
    #[inline]
    pub fn visible<const N: usize>(&self, a: &Vertex<N>, b: &Vertex<N>, tally: &mut Tally) -> bool {
        tally.rays_visibility += 1;
        let (near, far) = if a.kind == Kind::Infinite {
            (b, a)
        } else {
            (a, b)
        };
        if self.scene.geometry.leave_out {
            return self.visible_but_slivers(near, far);
        }
        if far.kind == Kind::Infinite {
            let o = offset_origin(near.p, near.error, near.ng, far.p);
            return !self.accel.occluded(&Ray {
                o: o.single(),
                d: far.p.single(),
                t_max: f32::INFINITY,
            });
        }
        visible(
            self.accel,
            near.p,
            near.error,
            near.normal(),
            far.p,
            far.error,
            far.normal(),
        )
    }

    /// As [`Self::visible`], of which only the second may be at infinity, without the slivers at the ends.
    #[inline(never)]
    fn visible_but_slivers<const N: usize>(&self, near: &Vertex<N>, far: &Vertex<N>) -> bool {
        let but = [self.off(near), self.off(far)];
        if far.kind == Kind::Infinite {
            let ray = Ray {
                o: offset_origin(near.p, near.error, near.ng, far.p).single(),
                d: far.p.single(),
                t_max: f32::INFINITY,
            };
            return match but {
                NOTHING => !self.accel.occluded(&ray),
                but => !self.accel.occluded_but(&ray, but),
            };
        }
        let [(p, e, n), b] = [near, far].map(|v| (v.p, v.error, v.normal()));
        match but {
            NOTHING => visible(self.accel, p, e, n, b.0, b.1, b.2),
            but => visible_but(self.accel, (p, e, n), b, but),
        }
    }
}
