//! What a path and the step to it are worth in numbers, to hold those of one build against those of another; and how far f32
//! may be off in the one of them for which that follows from the roundings alone.

use crate::path::{Path, Pool, Vertex, exp2i};
use crate::real::Convert;

/// What a number of a path is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Coordinate of the raster point, pixels. Compared as it is; most others by their ratio.
    Raster,
    /// f_s of a vertex, its mean over the wavelengths, [`Link::fs`](crate::path::Link::fs); L_e and W_e at the ends.
    Scattering,
    /// Geometry term of an edge.
    Geometry,
    /// Density of a vertex from the light side.
    FromLight,
    /// Density of a vertex from the eye side.
    FromEye,
    /// τ(f).
    Contribution,
    /// MIS weight p_s/Σp of a strategy. Compared as it is.
    Mis,
    /// τ of the MIS-weighted contribution, τ(f)/Σp.
    Weighted,
    /// T(y→x)·τ(y) / (T(x→y)·τ(x)) of the step that made the path.
    Ratio,
}

/// All of them with their names.
pub const KINDS: [(Kind, &str); 9] = [
    (Kind::Raster, "raster point, pixels"),
    (Kind::Scattering, "f_s at a vertex"),
    (Kind::Geometry, "G of an edge"),
    (Kind::FromLight, "density from the light"),
    (Kind::FromEye, "density from the eye"),
    (Kind::Contribution, "τ(f)"),
    (Kind::Mis, "MIS weight, absolute"),
    (Kind::Weighted, "τ(f)/Σp"),
    (Kind::Ratio, "ratio of a step"),
];

impl Kind {
    /// How far two values are apart: by themselves where 0 means nothing special, else relative to the larger.
    pub fn deviation(self, a: f64, b: f64) -> f64 {
        let off = (a - b).abs();
        let by = match self {
            Self::Raster | Self::Mis => off,
            _ if off == 0.0 => 0.0,
            _ => off / a.abs().max(b.abs()),
        };
        // What is no number in one build is not near anything.
        if by.is_nan() { f64::INFINITY } else { by }
    }
}

/// The numbers of a path that carries light; as many of each kind, in the same order, for all paths of as many edges.
/// `x` must have its strategies known.
pub fn quantities<const N: usize>(x: &Path<N>) -> impl Iterator<Item = (Kind, f64)> {
    let k = x.k();
    let raster = x.raster.double();
    let f = x.links[..k].iter().map(|l| l.g).product::<f64>() * x.shape_tau * exp2i(x.shape_exp);
    let of_vertex = x.links.iter().flat_map(|l| {
        [
            (Kind::Scattering, l.fs.mean() as f64),
            (Kind::FromLight, l.pl),
            (Kind::FromEye, l.pe),
        ]
    });
    let of_edge = x.links[..k].iter().map(|l| (Kind::Geometry, l.g));
    let mis = x.rho[..k + 2].iter().map(|r| (Kind::Mis, r / x.rho_sum()));
    [
        (Kind::Raster, raster.x),
        (Kind::Raster, raster.y),
        (Kind::Contribution, f),
        (Kind::Weighted, x.total / x.rho_sum()),
    ]
    .into_iter()
    .chain(of_vertex)
    .chain(of_edge)
    .chain(mis)
}

/// How far f32 may be off in the geometry term between two vertices, relative to it.
///
/// Both ends are known to their error bounds e, so the direction between them, over the distance d, to √3·(e + e′)/d and 3
/// roundings; a normal to one rounding and a product of both to three: 8u in all is more than these. A cosine errs by the
/// sum, which counts relative to it, and 1/d² by twice the first and its own roundings. `None` where this is half of the term
/// and more: f32 does not tell how large it is.
pub fn geometry_bound<const N: usize>(a: &Vertex<N>, b: &Vertex<N>) -> Option<f64> {
    let (dir, inv_d2) = a.towards(b);
    let u = 0.5 * f32::EPSILON as f64;
    let apart = 3f64.sqrt() * (a.error + b.error) as f64 * inv_d2.sqrt();
    let over = 1.0 / a.cos(dir) + 1.0 / b.cos(dir);
    let first = (apart + 8.0 * u) * over + 2.0 * apart + 8.0 * u;
    (first < 0.5).then(|| first / (1.0 - first))
}

/// The bound of each edge of a path.
pub fn geometry_bounds<const N: usize>(
    x: &Path<N>,
    pool: &Pool<N>,
) -> impl Iterator<Item = Option<f64>> {
    let ends = x.links.windows(2);
    ends.map(|l| geometry_bound(pool.get(l[0].slot), pool.get(l[1].slot)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::real::{Real, Vec3};
    use crate::scene::NONE;

    #[test]
    fn deviations_are_relative_where_zero_means_nothing() {
        let g = |a, b| Kind::Geometry.deviation(a, b);
        assert_eq!((g(3.0, 3.0), g(0.0, 0.0), g(2.0, 4.0)), (0.0, 0.0, 0.5));
        assert_eq!(g(4.0, 2.0), g(2.0, 4.0));
        assert_eq!(Kind::Mis.deviation(0.25, 0.5), 0.25);
        assert!([g(1.0, f64::NAN), g(f64::NAN, f64::NAN)].map(f64::is_infinite) == [true; 2]);
    }

    /// Two points at distance 1 on surfaces along the edge between them but for an angle whose cosine is `cos`.
    fn bound(cos: f64, error: f64) -> Option<f64> {
        let [a, b] = [Vec3::ZERO, Vec3::X].map(|p| {
            let (x, y) = (cos as Real, (1.0 - cos * cos).sqrt() as Real);
            let kind = crate::path::Kind::Surface;
            let mut v = Vertex::<1>::bare(kind, p, Vec3::new(x, y, 0.0), NONE);
            v.error = error as Real;
            v
        });
        geometry_bound(&a, &b)
    }

    #[test]
    fn the_bound_grows_with_the_angle_and_ends_where_nothing_is_known() {
        let u = 0.5 * f32::EPSILON as f64;
        let exact = bound(1.0, 0.0).expect("known");
        assert!((exact / (24.0 * u) - 1.0).abs() < 1e-5, "{exact:e}");
        let grazing = bound(1e-3, 0.0).expect("known");
        assert!((grazing / (16e3 * u) - 1.0).abs() < 0.01, "{grazing:e}");
        // √3·2e over the distance, for each cosine and twice for 1/d².
        let off = bound(1.0, 1e-4).expect("known");
        assert!((off / (8e-4 * 3f64.sqrt()) - 1.0).abs() < 0.01, "{off:e}");
        assert_eq!((bound(1e-7, 0.0), bound(1.0, 0.1)), (None, None));
    }
}
