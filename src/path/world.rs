//! What every path of a render shares.

use super::{Emitters, Kind, Lens, Sites, Tally, Vertex};
use crate::accel::{Accel, Ray, offset_origin, visible};
use crate::plan::{Effect, Plan};
use crate::real::{Convert, Real, Vec3};
use crate::scene::spectrum::{Grey, Lanes, Target};
use crate::scene::{Material, Scene};

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

    /// The origin of a ray that leaves `x` in direction `w`; `at` where `x` is on no surface.
    #[inline]
    pub fn leave<const N: usize>(&self, x: &Vertex<N>, at: Vec3, w: Vec3) -> Vec3 {
        if x.kind == Kind::Surface {
            offset_origin(x.p, x.error, x.ng, w)
        } else {
            at
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
}
