//! What a dielectric coat over a Lambertian base lets through: averages over the coat's facets, tabulated once.
//!
//! Light that has met the Lambertian base once has forgotten its direction. So the coat enters the exact solution of
//! the layered stack (no scattering between the layers) by two functions only: the share t(θ) of a beam that reaches
//! the base, which by reciprocity is also the factor of the way out, and the share r of the base's cosine-distributed
//! light that the coat sends back to it. Both hold the absorption exp(−d/|cos|) of each crossing of the layer.

use super::fresnel::{self, dielectric_parts};
use super::ggx::Ggx;
use super::rough_dielectric::refract_about;
use crate::real::{Real, Vec2, Vec3};
use std::sync::OnceLock;

/// Optical thickness of the layer: pbrt-v4's `thickness` default with its extinction 1, absorbing without scattering.
pub const THICKNESS: Real = 0.01;

/// The index enters by x = (η − 1)/(η + 1), odd under η → 1/η; the tables reach |x| ≤ 1/2, η from 1/3 to 3.
const X_MAX: Real = 0.5;

/// Nodes of the one-dimensional table over −1/2..=1/2; odd, so that η = 1, where r has a kink, is a node.
const SMOOTH_NODES: usize = 257;
/// Nodes over the index of rough coats, x in 0..=1/2.
const ETA_NODES: usize = 17;
/// Nodes over √α in 0..=1.
const ALPHA_NODES: usize = 12;
/// Nodes over √cos θ in 0..=1.
const COS_NODES: usize = 24;

/// Share of a beam at |cos θ| outside that reaches the base under a smooth coat.
#[inline]
pub fn smooth_transmittance(cos: Real, eta: Real) -> Real {
    let (r, t) = dielectric_parts(cos.abs(), eta);
    (1.0 - r) * absorb(t)
}

/// r of a smooth coat.
pub fn smooth_return(eta: Real) -> Real {
    static TABLE: OnceLock<Vec<Real>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        (0..SMOOTH_NODES)
            .map(|i| {
                let x = X_MAX * (2.0 * i as Real / (SMOOTH_NODES - 1) as Real - 1.0);
                integrate_smooth_return(eta_of(x))
            })
            .collect()
    });
    let (i, f) = split(0.5 * (x_of(eta) / X_MAX + 1.0), SMOOTH_NODES);
    table[i] * (1.0 - f) + table[i + 1] * f
}

/// Share of light that one crossing of the layer lets pass.
#[inline]
fn absorb(cos: Real) -> Real {
    if cos > 0.0 {
        (-THICKNESS / cos).exp()
    } else {
        0.0
    }
}

#[inline]
fn x_of(eta: Real) -> Real {
    (eta - 1.0) / (eta + 1.0)
}

fn eta_of(x: Real) -> Real {
    (1.0 + x) / (1.0 - x)
}

/// Interval of a table over 0..=1 and the place in it.
#[inline]
fn split(x: Real, nodes: usize) -> (usize, Real) {
    let y = x.clamp(0.0, 1.0) * (nodes - 1) as Real;
    let i = (y as usize).min(nodes - 2);
    (i, y - i as Real)
}

/// ∫ 2µ·F(µ)·exp(−2d/µ) dµ by the midpoint rule in √µ-free pieces either side of the critical angle.
fn integrate_smooth_return(eta: Real) -> Real {
    let critical = (1.0 - 1.0 / (eta * eta)).max(0.0).sqrt();
    let piece = |a: Real, b: Real| {
        const N: u32 = 256;
        let mut sum = 0.0;
        for i in 0..N {
            // Quadratic spacing towards `a`, where F has a vertical tangent or the absorption its fastest change.
            let s = (f64::from(i) + 0.5) / f64::from(N);
            let mu = a + (b - a) * (s * s) as Real;
            let value = mu * fresnel::dielectric(-mu, eta) * absorb(mu) * absorb(mu);
            sum += f64::from(2.0 * value * (b - a)) * 2.0 * s / f64::from(N);
        }
        sum
    };
    (piece(0.0, critical) + piece(critical, 1.0)) as Real
}

/// Place in the table of rough coats that belongs to an index and an α.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughCoat {
    /// Node of the index × nodes of α + node of α.
    cell: u16,
    /// Fraction between index nodes, in 1/65535.
    f_eta: u16,
    /// Fraction between α nodes, in 1/65535.
    f_alpha: u16,
}

impl RoughCoat {
    /// For a coat of index `eta` ≥ 1 with isotropic roughness `alpha`, both held inside the table.
    #[inline]
    pub fn new(eta: Real, alpha: Real) -> Self {
        let (e, f_eta) = split(x_of(eta) / X_MAX, ETA_NODES);
        let (a, f_alpha) = split(alpha.max(0.0).sqrt(), ALPHA_NODES);
        Self {
            cell: (e * ALPHA_NODES + a) as u16,
            f_eta: (f_eta * 65535.0) as u16,
            f_alpha: (f_alpha * 65535.0) as u16,
        }
    }

    /// t at |cos θ|.
    #[inline]
    pub fn transmittance(&self, cos: Real) -> Real {
        let t = &table().transmittance;
        let (c, f) = split(cos.abs().sqrt(), COS_NODES);
        self.blend(|cell| {
            let row = cell * COS_NODES + c;
            t[row] * (1.0 - f) + t[row + 1] * f
        })
    }

    /// r of this coat.
    #[inline]
    pub fn base_return(&self) -> Real {
        let r = &table().base_return;
        self.blend(|cell| r[cell])
    }

    #[inline]
    fn blend(&self, at: impl Fn(usize) -> Real) -> Real {
        let c = usize::from(self.cell);
        let (e, a) = (
            Real::from(self.f_eta) / 65535.0,
            Real::from(self.f_alpha) / 65535.0,
        );
        (1.0 - e) * ((1.0 - a) * at(c) + a * at(c + 1))
            + e * ((1.0 - a) * at(c + ALPHA_NODES) + a * at(c + ALPHA_NODES + 1))
    }
}

struct Table {
    /// [index][α][√cos].
    transmittance: Vec<Real>,
    /// [index][α].
    base_return: Vec<Real>,
}

fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(Table::build)
}

impl Table {
    fn build() -> Self {
        let mut t = Self {
            transmittance: Vec::with_capacity(ETA_NODES * ALPHA_NODES * COS_NODES),
            base_return: Vec::with_capacity(ETA_NODES * ALPHA_NODES),
        };
        for e in 0..ETA_NODES {
            let eta = eta_of(X_MAX * e as Real / (ETA_NODES - 1) as Real);
            for a in 0..ALPHA_NODES {
                // The first node stands for the smooth coat; its facets need some width to be integrated over.
                let alpha = (a as Real / (ALPHA_NODES - 1) as Real).powi(2).max(1e-3);
                let ggx = Ggx {
                    ax: alpha,
                    ay: alpha,
                };
                for c in 0..COS_NODES {
                    let cos = (c as Real / (COS_NODES - 1) as Real).powi(2).max(1e-4);
                    t.transmittance
                        .push(integrate_transmittance(&ggx, eta, cos));
                }
                t.base_return.push(integrate_return(&ggx, eta));
            }
        }
        t
    }
}

/// Mean of `f(m)` over the normals a direction at `cos` in the x–z plane sees: the midpoint rule over the square that
/// sampling maps, halved by the mirror symmetry of the isotropic case.
fn over_normals(ggx: &Ggx, w: Vec3, n: u32, f: impl Fn(Vec3) -> Real) -> Real {
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n / 2 {
            let u = Vec2::new(i as Real + 0.5, j as Real + 0.5) / n as Real;
            sum += f(ggx.sample_visible(w, u));
        }
    }
    sum / (n * n / 2) as Real
}

fn integrate_transmittance(ggx: &Ggx, eta: Real, cos: Real) -> Real {
    let w = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
    over_normals(ggx, w, 16, |m| {
        let t = 1.0 - fresnel::dielectric(w.dot(m), eta);
        match refract_about(w, m, eta) {
            Some(to) if to.z < 0.0 => t * ggx.g2(w, to) / ggx.g1(w) * absorb(-to.z),
            _ => 0.0,
        }
    })
}

fn integrate_return(ggx: &Ggx, eta: Real) -> Real {
    const N: u32 = 48;
    let mut sum = 0.0;
    for i in 0..N {
        let mu = ((i as Real + 0.5) / N as Real).sqrt();
        let w = Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, -mu);
        sum += absorb(mu)
            * over_normals(ggx, w, 12, |m| {
                let to = 2.0 * w.dot(m) * m - w;
                if to.z < 0.0 {
                    let r = fresnel::dielectric(w.dot(m), eta);
                    r * ggx.g2(w, to) / ggx.g1(w) * absorb(-to.z)
                } else {
                    0.0
                }
            });
    }
    sum / N as Real
}
