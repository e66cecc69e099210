//! Where light comes from: choice among lights, points on them, directions from them, and their densities.
//!
//! One fixed distribution over all lights chooses everywhere, so every p_{s,t} evaluates it exactly. All infinite lights
//! that are not delta are one emitter, the sky: its radiance is their sum and its density the mixture of theirs.

use super::{Kind, Palette, Vertex};
use crate::accel::surface::{quadric_at, surface_at};
use crate::plan::light_powers;
use crate::real::{Convert, Real, Vec2, Vec3};
use crate::sampling::{Discrete, Grid2d, Rng, octahedral, warp};
use crate::scatter::Frame;
use crate::scene::spectrum::{Lanes, Rgb2Spec, Spectrum};
use crate::scene::{Light, NONE, PrimId, Quadric, Scene};
use std::f64::consts::PI;

/// The lights of a scene made ready for sampling.
pub struct Emitters {
    choice: Option<Discrete>,
    /// Indices of the non-delta infinite lights.
    sky: Vec<u32>,
    /// Directional distribution of each infinite image light, parallel to `sky`.
    grids: Vec<Option<Grid2d>>,
    /// 1/area of each light's primitive, 0 for others.
    inv_area: Vec<f64>,
    center: Vec3,
    radius: Real,
    /// Some emitter can be hit by a ray.
    pub hittable: bool,
    /// Some light exists that emits anything.
    pub any: bool,
}

/// What chooses a point on a light: numbers uniform in [0, 1).
#[derive(Clone, Copy, Debug)]
pub struct LightPoint {
    /// Which light.
    pub choice: f64,
    /// Where on it.
    pub at: Vec2,
}

impl LightPoint {
    /// Drawn from `rng`.
    #[inline]
    pub fn new(rng: &mut Rng) -> Self {
        Self {
            choice: rng.next_f64(),
            at: rng.next_vec2(),
        }
    }
}

impl Emitters {
    /// Prepares the lights of a scene; they are chosen in proportion to their luminous power.
    pub fn new(scene: &Scene) -> Self {
        Self::among(scene, |_| true, light_powers(scene, |_| true))
    }

    /// As [`Self::new`], of the lights for which `lit` holds; the others must be such that they give no path anything.
    /// `weights` says how often each light is chosen.
    pub fn among(scene: &Scene, lit: impl Fn(usize) -> bool, weights: Vec<f64>) -> Self {
        let (center, radius) = scene.bounding_sphere();
        let (center, radius) = (center.real(), radius.real());
        let (mut sky, mut grids) = (Vec::new(), Vec::new());
        let mut inv_area = vec![0.0; scene.lights.len()];
        let mut hittable = false;
        for (i, l) in scene.lights.iter().enumerate().filter(|l| lit(l.0)) {
            match l {
                Light::Area { prim, .. } => {
                    inv_area[i] = 1.0 / scene.geometry.area(*prim);
                    hittable = true;
                }
                Light::InfiniteConstant { .. } => {
                    sky.push(i as u32);
                    grids.push(None);
                    hittable = true;
                }
                Light::InfiniteImage { image, .. } => {
                    sky.push(i as u32);
                    hittable = true;
                    let im = &scene.images[*image as usize];
                    let values: Vec<f32> = im.rgb().map(|c| (c[0] + c[1] + c[2]) / 3.0).collect();
                    grids.push(Grid2d::new(im.width as usize, &values));
                }
                Light::Point { .. } | Light::Spot { .. } | Light::Distant { .. } => {}
            }
        }
        let choice = Discrete::new(weights);
        let any = choice.is_some();
        Self {
            choice,
            sky,
            grids,
            inv_area,
            center,
            radius,
            hittable: hittable && any,
            any,
        }
    }

    /// Some non-delta light stands at infinity.
    pub fn has_sky(&self) -> bool {
        !self.sky.is_empty()
    }

    /// The sky in unit direction `w`.
    pub fn sky_vertex<const N: usize>(
        &self,
        scene: &Scene,
        lanes: &Lanes<N>,
        w: Vec3,
    ) -> Vertex<N> {
        let mut v = Vertex::bare(Kind::Infinite, w, Vec3::ZERO, NONE);
        v.emission = self
            .sky
            .iter()
            .fold(Spectrum::ZERO, |sum, &i| sum + from_sky(scene, i, lanes, w));
        v
    }

    /// Samples x0; its density is [`Self::pdf_point`].
    pub fn sample_point<const N: usize>(
        &self,
        scene: &Scene,
        palette: &Palette<N>,
        LightPoint { choice, at: u }: LightPoint,
    ) -> Option<Vertex<N>> {
        let (i, _) = self.choice.as_ref()?.sample(choice);
        Some(match &scene.lights[i] {
            Light::Area { prim, .. } => {
                let s = match scene.geometry.quadric(*prim) {
                    None => {
                        let [_, b1, b2] = warp::triangle(u);
                        surface_at(&scene.geometry, *prim, b1, b2)
                    }
                    Some(q @ Quadric::Sphere { center, radius, .. }) => quadric_at(
                        q,
                        (center.real() + warp::sphere(u) * radius.real()).double(),
                    ),
                    Some(
                        q @ Quadric::Disk {
                            center,
                            normal,
                            tangent,
                            radius,
                        },
                    ) => {
                        let (n, t) = (normal.real(), tangent.real());
                        let d = warp::disk(u) * radius.real();
                        quadric_at(q, (center.real() + t * d.x + n.cross(t) * d.y).double())
                    }
                };
                Vertex::from_surface(scene, PrimId::of(*prim), &s, palette)
            }
            Light::Point { position, .. } | Light::Spot { position, .. } => {
                let mut v = Vertex::bare(Kind::Point, position.real(), Vec3::ZERO, i as u32);
                v.emission = palette.emission(scene, i as u32);
                v
            }
            Light::Distant { direction, .. } => {
                let mut v = Vertex::bare(Kind::Infinite, -direction.real(), Vec3::ZERO, i as u32);
                v.emission = palette.emission(scene, i as u32);
                v
            }
            Light::InfiniteConstant { .. } => {
                self.sky_vertex(scene, palette.lanes(), warp::sphere(u))
            }
            Light::InfiniteImage { to_world, .. } => {
                let g = self
                    .sky
                    .iter()
                    .position(|&k| k == i as u32)
                    .and_then(|k| self.grids[k].as_ref())?;
                let w = (to_world.real() * octahedral::to_sphere(g.sample(u).0)).normalize();
                self.sky_vertex(scene, palette.lanes(), w)
            }
        })
    }

    /// Probability of choosing light `i`.
    #[inline]
    fn pmf(&self, i: u32) -> f64 {
        self.choice.as_ref().map_or(0.0, |c| c.pmf(i as usize))
    }

    /// Density of x0: per area on surfaces, per solid angle for the sky, the bare probability for deltas.
    pub fn pdf_point<const N: usize>(&self, scene: &Scene, x0: &Vertex<N>) -> f64 {
        match x0.kind {
            Kind::Surface if x0.light != NONE => {
                self.pmf(x0.light) * self.inv_area[x0.light as usize]
            }
            Kind::Point => self.pmf(x0.light),
            Kind::Infinite if x0.light != NONE => self.pmf(x0.light),
            Kind::Infinite => self
                .sky
                .iter()
                .zip(&self.grids)
                .map(|(&i, g)| {
                    let p = match (&scene.lights[i as usize], g) {
                        (Light::InfiniteImage { to_world, .. }, Some(g)) => {
                            g.pdf(octahedral::to_square(to_world.real().transpose() * x0.p)) as f64
                                / (4.0 * PI)
                        }
                        _ => 1.0 / (4.0 * PI),
                    };
                    self.pmf(i) * p
                })
                .sum(),
            _ => 0.0,
        }
    }

    /// The vertex can be hit by a ray that knows nothing of the light: no delta.
    pub fn can_be_hit<const N: usize>(x0: &Vertex<N>) -> bool {
        match x0.kind {
            Kind::Surface => x0.light != NONE,
            Kind::Infinite => x0.light == NONE,
            _ => false,
        }
    }

    /// Radiance (intensity for a point, irradiance for a distant light) that leaves x0 in unit direction `w`.
    #[inline]
    pub fn radiance<const N: usize>(&self, scene: &Scene, x0: &Vertex<N>, w: Vec3) -> Spectrum<N> {
        if x0.light == NONE {
            return x0.emission;
        }
        match &scene.lights[x0.light as usize] {
            Light::Area { two_sided, .. } if *two_sided || x0.ng.dot(w) > 0.0 => x0.emission,
            Light::Point { .. } | Light::Distant { .. } => x0.emission,
            Light::Spot {
                direction,
                cos_start,
                cos_end,
                ..
            } => {
                let (start, end) = (cos_start.real(), cos_end.real());
                let c = ((direction.real().dot(w) - end) / (start - end)).clamp(0.0, 1.0);
                x0.emission * (c * c * (3.0 - 2.0 * c))
            }
            _ => Spectrum::ZERO,
        }
    }

    /// Samples a ray that leaves x0: origin and unit direction. A vertex at infinity sends it through the scene's disk.
    pub fn sample_direction<const N: usize>(
        &self,
        scene: &Scene,
        x0: &Vertex<N>,
        rng: &mut Rng,
    ) -> (Vec3, Vec3) {
        let u = rng.next_vec2();
        match x0.kind {
            Kind::Infinite => {
                let f = Frame::from_normal(x0.p);
                let d = warp::disk(u) * self.radius;
                // Two radii away: outside the scene whatever the disk point.
                (
                    self.center + f.to_world(Vec3::new(d.x, d.y, 0.0)) + x0.p * (2.0 * self.radius),
                    -x0.p,
                )
            }
            Kind::Point => match &scene.lights[x0.light as usize] {
                Light::Spot {
                    direction, cos_end, ..
                } => {
                    let z = 1.0 - u.x * (1.0 - cos_end.real());
                    let r = (1.0 - z * z).max(0.0).sqrt();
                    let (s, c) = (2.0 * crate::real::consts::PI * u.y).sin_cos();
                    (
                        x0.p,
                        Frame::from_normal(direction.real())
                            .to_world(Vec3::new(r * c, r * s, z))
                            .normalize(),
                    )
                }
                _ => (x0.p, warp::sphere(u)),
            },
            _ => {
                let both = matches!(
                    scene.lights.get(x0.light as usize),
                    Some(Light::Area {
                        two_sided: true,
                        ..
                    })
                );
                let side = if both && rng.next_f32() < 0.5 {
                    -1.0
                } else {
                    1.0
                };
                (
                    x0.p,
                    Frame::from_normal(x0.ng * side)
                        .to_world(warp::cosine_hemisphere(u))
                        .normalize(),
                )
            }
        }
    }

    /// The origin outside of the scene of a ray from the direction `to_light` that passes the point `through`.
    #[inline]
    pub fn entry(&self, to_light: Vec3, through: Vec3) -> Vec3 {
        through + to_light * (to_light.dot(self.center - through) + 2.0 * self.radius)
    }

    /// Density per solid angle of [`Self::sample_direction`]; for a vertex at infinity, per area across the direction.
    #[inline]
    pub fn pdf_direction<const N: usize>(&self, scene: &Scene, x0: &Vertex<N>, w: Vec3) -> f64 {
        match x0.kind {
            Kind::Infinite => 1.0 / (PI * (self.radius as f64).powi(2)),
            Kind::Point => match &scene.lights[x0.light as usize] {
                Light::Spot {
                    direction, cos_end, ..
                } => {
                    if direction.real().dot(w) > cos_end.real() {
                        1.0 / (2.0 * PI * (1.0 - *cos_end as f64))
                    } else {
                        0.0
                    }
                }
                _ => 1.0 / (4.0 * PI),
            },
            _ => {
                let c = x0.ng.dot(w) as f64;
                match scene.lights.get(x0.light as usize) {
                    Some(Light::Area {
                        two_sided: true, ..
                    }) => c.abs() / (2.0 * PI),
                    Some(Light::Area { .. }) => c.max(0.0) / PI,
                    _ => 0.0,
                }
            }
        }
    }
}

/// What the infinite light `light` sends from unit direction `to_sky`.
fn from_sky<const N: usize>(
    scene: &Scene,
    light: u32,
    lanes: &Lanes<N>,
    to_sky: Vec3,
) -> Spectrum<N> {
    match &scene.lights[light as usize] {
        Light::InfiniteConstant { radiance } => radiance.eval(lanes),
        Light::InfiniteImage {
            image,
            to_world,
            illuminant,
        } => {
            let im = &scene.images[*image as usize];
            let st = octahedral::to_square(to_world.real().transpose() * to_sky);
            let (w, h) = (im.width as usize, im.height as usize);
            let x = ((st.x * w as Real) as usize).min(w - 1);
            let y = ((st.y * h as Real) as usize).min(h - 1);
            let rgb = im.texel(y * w + x);
            let scale = 2.0 * rgb[0].max(rgb[1]).max(rgb[2]);
            if scale <= 0.0 {
                return Spectrum::ZERO;
            }
            Rgb2Spec::get().fetch(rgb.map(|c| c / scale)).eval(lanes)
                * scale.real()
                * illuminant.eval(lanes)
        }
        _ => Spectrum::ZERO,
    }
}
