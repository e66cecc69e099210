//! What can take part in the image at all, as far as that is certain: materials that some surface is made of, lights that
//! reach something. Where it is not certain a thing counts as taking part.

use super::colour::spectrum;
use crate::scene::spectrum::Curve;
use crate::scene::texture::FloatTexture;
use crate::scene::{Camera, Geometry, Light, Material, Scene};
use glam::Vec3;
use serde::Serialize;

/// Why a light gives the image nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Dark {
    /// It emits nothing at any wavelength.
    Black,
    /// All surfaces and the camera are behind it.
    FacesAway,
    /// All surfaces are behind the light, whose cone does not open so far.
    Misses,
}

impl Dark {
    /// In words.
    pub fn why(self) -> &'static str {
        match self {
            Self::Black => "emits nothing",
            Self::FacesAway => "everything is behind it",
            Self::Misses => "its cone holds no surface",
        }
    }
}

/// For each material, whether some primitive is made of it, mixes seen through.
pub fn live_materials(scene: &Scene) -> Vec<bool> {
    let mut live = vec![false; scene.materials.len()];
    let mut open: Vec<u32> = Vec::new();
    for part in scene.geometry.parts() {
        let shapes = part.shapes.iter().zip(used_shapes(part));
        open.extend(shapes.filter(|s| s.1).map(|s| s.0.material));
    }
    while let Some(m) = open.pop() {
        let Some(material) = scene.materials.get(m as usize) else {
            continue;
        };
        if std::mem::replace(&mut live[m as usize], true) {
            continue;
        }
        if let Material::Mix { a, b, .. } = material {
            match certain(material) {
                Some(one) => open.push(one),
                None => open.extend([*a, *b]),
            }
        }
    }
    live
}

/// For each shape of a geometry, whether some primitive is a part of it.
pub(super) fn used_shapes(g: &Geometry) -> Vec<bool> {
    let mut used = vec![false; g.shapes.len()];
    for &s in &g.prim_shape {
        used[s as usize] = true;
    }
    used
}

/// The one material that a mix certainly is.
pub fn certain(material: &Material) -> Option<u32> {
    match material {
        Material::Mix {
            amount: FloatTexture::Constant(v),
            a,
            b,
        } => {
            if *v >= 1.0 {
                Some(*b)
            } else if *v > 0.0 {
                None
            } else {
                Some(*a)
            }
        }
        _ => None,
    }
}

/// For each light, why it certainly gives nothing, if so.
pub fn dark_lights(scene: &Scene) -> Vec<Option<Dark>> {
    let corners = corners(&scene.geometry);
    let of = |l: &Light| dark(l, &scene.geometry, &scene.camera, &corners, &scene.images);
    scene.lights.iter().map(of).collect()
}

fn dark(
    light: &Light,
    geometry: &Geometry,
    camera: &Camera,
    corners: &[Vec3],
    images: &[crate::scene::texture::Image],
) -> Option<Dark> {
    let no_texel = match light {
        Light::InfiniteImage { image, .. } => images
            .get(*image as usize)
            .is_none_or(|i| i.rgb().all(|c| c == [0.0; 3])),
        _ => false,
    };
    if no_texel || is_black(spectrum(light)) {
        return Some(Dark::Black);
    }
    match light {
        Light::Area {
            prim,
            two_sided: false,
            ..
        } if geometry.quadric(*prim).is_none() => {
            let [a, b, c] = geometry.corners(*prim).map(|p| p.as_dvec3());
            let n = (b - a).cross(c - a);
            let height = |p: &Vec3| n.dot(p.as_dvec3() - a);
            let lens = height(&camera.position) + camera.lens_radius as f64 * n.length();
            (lens <= 0.0 && corners.iter().all(|p| height(p) <= 0.0)).then_some(Dark::FacesAway)
        }
        Light::Spot {
            position,
            direction,
            cos_end,
            ..
        } if *cos_end >= 0.0 => {
            let (p, d) = (position.as_dvec3(), direction.as_dvec3());
            let behind = |c: &Vec3| (c.as_dvec3() - p).dot(d) < 0.0;
            (!corners.is_empty() && corners.iter().all(behind)).then_some(Dark::Misses)
        }
        _ => None,
    }
}

fn is_black(c: &Curve) -> bool {
    match c {
        Curve::Constant(v) => *v == 0.0,
        Curve::Sigmoid { scale, .. } => *scale == 0.0,
        Curve::Illuminant { scale, table, .. } | Curve::Table { scale, table } => {
            *scale == 0.0 || table.iter().all(|v| *v == 0.0)
        }
    }
}

/// The corners of a box around all surfaces; none without surfaces.
fn corners(geometry: &Geometry) -> Vec<Vec3> {
    let Some((lo, hi)) = geometry.bounds() else {
        return Vec::new();
    };
    let corner = |i: usize| {
        let pick = |bit: usize, lo: f32, hi: f32| if i >> bit & 1 == 0 { lo } else { hi };
        Vec3::new(
            pick(0, lo.x, hi.x),
            pick(1, lo.y, hi.y),
            pick(2, lo.z, hi.z),
        )
    };
    (0..8).map(corner).collect()
}
