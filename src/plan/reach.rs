//! What can take part in the image at all, as far as that is certain: materials that some surface is made of, lights that
//! reach something. Where it is not certain a thing counts as taking part.

use super::colour::spectrum;
use crate::scene::material::ConductorFresnel;
use crate::scene::spectrum::Curve;
use crate::scene::texture::{FloatTexture, SpectrumTexture};
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

/// For each material, whether some primitive is made of it, mixes seen through. The shapes of the world that are `unseen`
/// do not count.
pub fn live_materials(scene: &Scene, unseen: &[bool]) -> Vec<bool> {
    let mut live = vec![false; scene.materials.len()];
    let mut open: Vec<u32> = Vec::new();
    for (part, used) in scene.geometry.parts().zip(used_shapes(scene, unseen)) {
        let shapes = part.shapes.iter().zip(used);
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

/// For each shape of the world and of each object, whether some primitive is a part of it and it is not `unseen`.
pub(super) fn used_shapes(scene: &Scene, unseen: &[bool]) -> Vec<Vec<bool>> {
    let used = |g: &Geometry| {
        let mut used = vec![false; g.shapes.len()];
        for &s in &g.prim_shape {
            used[s as usize] = true;
        }
        used
    };
    let mut all: Vec<Vec<bool>> = scene.geometry.parts().map(used).collect();
    // The world comes first.
    for (used, unseen) in all[0].iter_mut().zip(unseen) {
        *used &= !unseen;
    }
    all
}

/// Whether a material certainly sends no light on.
pub(super) fn is_black_material(m: &Material) -> bool {
    match m {
        Material::Diffuse { reflectance: r }
        | Material::Conductor {
            fresnel: ConductorFresnel::Reflectance(r),
            ..
        } => is_black_texture(r),
        _ => false,
    }
}

/// Whether a texture is certainly 0 everywhere.
pub(super) fn is_black_texture(t: &SpectrumTexture) -> bool {
    match t {
        SpectrumTexture::Constant(c) => is_black(c),
        SpectrumTexture::Scale(t, by) => {
            is_black_texture(t) || matches!(**by, FloatTexture::Constant(v) if v == 0.0)
        }
        SpectrumTexture::Checkerboard(_, a, b) => is_black_texture(a) && is_black_texture(b),
        SpectrumTexture::Image(_) => false,
    }
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
    let bounds = geometry.bounds();
    bounds.map_or(Vec::new(), |(lo, hi)| box_corners(lo, hi).into())
}

/// The corners of a box.
pub(super) fn box_corners(lo: Vec3, hi: Vec3) -> [Vec3; 8] {
    let pick = |bit: usize, lo: f32, hi: f32| if bit & 1 == 0 { lo } else { hi };
    std::array::from_fn(|i| {
        Vec3::new(
            pick(i, lo.x, hi.x),
            pick(i >> 1, lo.y, hi.y),
            pick(i >> 2, lo.z, hi.z),
        )
    })
}
