//! A path in words and numbers: every digit that a quantity has.

use crate::path::{Path, Pool};
use crate::scene::NONE;
use std::fmt::{Display, Write};

/// A line of a name and a value.
pub fn line(t: &mut String, name: &str, value: impl Display) {
    let _ = writeln!(t, "{name}: {value}");
}

/// A path with its vertices, links, densities and tables.
pub fn path_text<const N: usize>(name: &str, p: &Path<N>, pool: &Pool<N>) -> String {
    let mut t = String::new();
    let k = p.k();
    let _ = writeln!(
        t,
        "{name}: {k} edges, raster {} {}, wavelengths {:?} nm",
        p.raster.x, p.raster.y, p.lanes.lambda
    );
    for (i, l) in p.links.iter().enumerate() {
        let v = pool.get(l.slot);
        let number = |n: u32| {
            if n == NONE {
                "none".into()
            } else {
                n.to_string()
            }
        };
        let _ = writeln!(
            t,
            "  {name}{i} {:?} {:?} at {} ± {:e}, normal {}, shading normal {}, material {}, light {}",
            v.kind,
            l.mode,
            v.p,
            v.error,
            v.ng,
            v.ns,
            number(v.material),
            number(v.light)
        );
        let _ = writeln!(
            t,
            "     f_s {:?}, p^L {:e}, p^E {:e}, modes chosen with {} and {}",
            l.fs.0, l.pl, l.pe, l.prob_l, l.prob_e
        );
        if i < k {
            let _ = writeln!(
                t,
                "     to {name}{}: direction {}, 1/d² {:e}, cosines {} and {}, G {:e}",
                i + 1,
                l.dir,
                l.inv_d2,
                l.cos_near,
                l.cos_far,
                l.g
            );
        }
    }
    let _ = writeln!(
        t,
        "  f / 2^{}: {:?}, τ / 2^{}: {:e}",
        p.shape_exp, p.shape.0, p.shape_exp, p.shape_tau
    );
    if p.known {
        let _ = writeln!(
            t,
            "  ρ_s {:?}, τ(C*_s)·ρ_s {:e}, deletion weights {:?}",
            &p.rho[..k + 2],
            p.total,
            &p.deletion[1..k + 3]
        );
    }
    t
}
