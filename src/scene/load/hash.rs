//! A stable 64-bit hash of everything that can change the image.

use crate::scene::geometry::{Geometry, Quadric};
use crate::scene::light::Light;
use crate::scene::material::{ConductorFresnel, Material, Roughness};
use crate::scene::spectrum::{Curve, Sigmoid};
use crate::scene::texture::{FloatTexture, ImageMap, SpectrumTexture, UvMapping};
use crate::scene::{FilterKind, Scene};

/// FNV-1a over 32-bit words instead of bytes, with a final mixing so that the high bits depend on all input.
/// Part of the promise of checkpoints: it must not change with compiler or platform.
pub(super) struct Hash(u64);

impl Hash {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn u32(&mut self, v: u32) {
        self.0 = (self.0 ^ u64::from(v)).wrapping_mul(0x0000_0100_0000_01b3);
        // The multiplication only carries upwards; the rotation lets high bits come back down.
        self.0 = self.0.rotate_left(23);
    }

    fn f32(&mut self, v: f32) {
        self.u32(v.to_bits());
    }

    fn floats(&mut self, v: &[f32]) {
        self.u32(v.len() as u32);
        v.iter().for_each(|x| self.f32(*x));
    }

    fn f64(&mut self, v: f64) {
        self.u32(v.to_bits() as u32);
        self.u32((v.to_bits() >> 32) as u32);
    }

    fn done(self) -> u64 {
        let h = (self.0 ^ (self.0 >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
        h ^ (h >> 32)
    }

    fn sigmoid(&mut self, s: &Sigmoid) {
        self.floats(&[s.c0, s.c1, s.c2]);
    }

    fn curve(&mut self, c: &Curve) {
        match c {
            Curve::Constant(v) => {
                self.u32(0);
                self.f32(*v);
            }
            Curve::Sigmoid { scale, shape } => {
                self.u32(1);
                self.f32(*scale);
                self.sigmoid(shape);
            }
            Curve::Illuminant {
                scale,
                shape,
                table,
            } => {
                self.u32(2);
                self.f32(*scale);
                self.sigmoid(shape);
                self.floats(table);
            }
            Curve::Table { scale, table } => {
                self.u32(3);
                self.f32(*scale);
                self.floats(table);
            }
        }
    }

    fn mapping(&mut self, m: &UvMapping) {
        self.floats(&[m.scale.x, m.scale.y, m.offset.x, m.offset.y]);
    }

    fn image_map(&mut self, m: &ImageMap) {
        self.u32(m.image);
        self.mapping(&m.mapping);
        self.u32(m.wrap as u32 | u32::from(m.point) << 8 | u32::from(m.invert) << 9);
        self.f32(m.scale);
    }

    fn float_texture(&mut self, t: &FloatTexture) {
        match t {
            FloatTexture::Constant(v) => {
                self.u32(0);
                self.f32(*v);
            }
            FloatTexture::Image(m) => {
                self.u32(1);
                self.image_map(m);
            }
            FloatTexture::Scale(a, b) => {
                self.u32(2);
                self.float_texture(a);
                self.float_texture(b);
            }
            FloatTexture::Checkerboard(m, a, b) => {
                self.u32(3);
                self.mapping(m);
                self.float_texture(a);
                self.float_texture(b);
            }
        }
    }

    fn spectrum_texture(&mut self, t: &SpectrumTexture) {
        match t {
            SpectrumTexture::Constant(c) => {
                self.u32(0);
                self.curve(c);
            }
            SpectrumTexture::Image(m) => {
                self.u32(1);
                self.image_map(m);
            }
            SpectrumTexture::Scale(a, b) => {
                self.u32(2);
                self.spectrum_texture(a);
                self.float_texture(b);
            }
            SpectrumTexture::Checkerboard(m, a, b) => {
                self.u32(3);
                self.mapping(m);
                self.spectrum_texture(a);
                self.spectrum_texture(b);
            }
        }
    }

    fn roughness(&mut self, r: &Roughness) {
        self.float_texture(&r.u);
        self.float_texture(&r.v);
        self.u32(r.remap.into());
    }

    fn material(&mut self, m: &Material) {
        match m {
            Material::Diffuse { reflectance } => {
                self.u32(0);
                self.spectrum_texture(reflectance);
            }
            Material::Conductor { fresnel, roughness } => {
                match fresnel {
                    ConductorFresnel::EtaK { eta, k } => {
                        self.u32(1);
                        self.curve(eta);
                        self.curve(k);
                    }
                    ConductorFresnel::Reflectance(r) => {
                        self.u32(2);
                        self.spectrum_texture(r);
                    }
                }
                self.roughness(roughness);
            }
            Material::Dielectric { eta, roughness } => {
                self.u32(3);
                self.curve(eta);
                self.roughness(roughness);
            }
            Material::ThinDielectric { eta } => {
                self.u32(4);
                self.curve(eta);
            }
            Material::CoatedDiffuse {
                reflectance,
                eta,
                roughness,
            } => {
                self.u32(5);
                self.spectrum_texture(reflectance);
                self.curve(eta);
                self.roughness(roughness);
            }
            Material::Mix { amount, a, b } => {
                self.u32(6);
                self.float_texture(amount);
                self.u32(*a);
                self.u32(*b);
            }
        }
    }

    fn light(&mut self, light: &Light) {
        match light {
            Light::Area {
                prim,
                two_sided,
                radiance,
            } => {
                self.u32(*two_sided as u32);
                self.u32(*prim);
                self.curve(radiance);
            }
            Light::Point {
                position,
                intensity,
            } => {
                self.u32(2);
                self.floats(&position.to_array());
                self.curve(intensity);
            }
            Light::Spot {
                position,
                direction,
                cos_start,
                cos_end,
                intensity,
            } => {
                self.u32(3);
                self.floats(&position.to_array());
                self.floats(&direction.to_array());
                self.floats(&[*cos_start, *cos_end]);
                self.curve(intensity);
            }
            Light::Distant {
                direction,
                irradiance,
            } => {
                self.u32(4);
                self.floats(&direction.to_array());
                self.curve(irradiance);
            }
            Light::InfiniteConstant { radiance } => {
                self.u32(5);
                self.curve(radiance);
            }
            Light::InfiniteImage {
                image,
                to_world,
                illuminant,
            } => {
                self.u32(6);
                self.u32(*image);
                self.floats(&to_world.to_cols_array());
                self.curve(illuminant);
            }
        }
    }

    fn part(&mut self, g: &Geometry) {
        for p in &g.positions {
            self.floats(&p.to_array());
        }
        for n in &g.normals {
            self.floats(&n.to_array());
        }
        for uv in &g.uvs {
            self.floats(&uv.to_array());
        }
        for t in &g.triangles {
            t.iter().for_each(|i| self.u32(*i));
        }
        g.quadrics.iter().for_each(|q| self.quadric(q));
        for list in [&g.prim_shape, &g.prim_light] {
            list.iter().for_each(|i| self.u32(*i));
        }
        for s in &g.shapes {
            self.u32(s.material);
            self.u32(u32::from(s.has_normals) | u32::from(s.has_uvs) << 1);
        }
    }

    fn quadric(&mut self, q: &Quadric) {
        match q {
            Quadric::Sphere {
                center,
                radius,
                to_object,
                inward,
            } => {
                self.u32(*inward as u32);
                self.floats(&center.to_array());
                self.f32(*radius);
                self.floats(&to_object.to_cols_array());
            }
            Quadric::Disk {
                center,
                normal,
                tangent,
                radius,
            } => {
                self.u32(2);
                self.floats(&center.to_array());
                self.floats(&normal.to_array());
                self.floats(&tangent.to_array());
                self.f32(*radius);
            }
        }
    }
}

/// The scene's hash. Names, places, warnings, sample counts and the choice of integrator do not count.
pub(super) fn scene_hash(scene: &Scene) -> u64 {
    let mut h = Hash::new();
    let g = &scene.geometry;
    h.part(g);
    g.objects.iter().for_each(|o| h.part(o));
    for i in &g.instances {
        h.u32(i.object);
        h.floats(&i.linear.to_cols_array());
        h.floats(&i.translation.to_array());
    }
    scene.materials.iter().for_each(|m| h.material(m));
    for i in &scene.images {
        h.u32(i.width);
        i.rgb().for_each(|c| h.floats(&c));
    }
    scene.lights.iter().for_each(|l| h.light(l));
    let c = &scene.camera;
    h.floats(&c.position.to_array());
    h.floats(&c.axes.to_cols_array());
    c.resolution.iter().chain(&c.crop).for_each(|v| h.u32(*v));
    h.floats(&c.screen);
    h.floats(&[c.lens_radius, c.focal_distance]);
    let s = &scene.settings;
    h.u32(s.max_depth);
    h.f32(s.film_scale);
    h.floats(&s.filter.radius);
    match s.filter.kind {
        FilterKind::Box => h.u32(0),
        FilterKind::Triangle => h.u32(1),
        FilterKind::Gaussian { sigma } => {
            h.u32(2);
            h.f32(sigma);
        }
        FilterKind::Mitchell { b, c } => {
            h.u32(3);
            h.floats(&[b, c]);
        }
    }
    scene.origin.to_array().into_iter().for_each(|v| h.f64(v));
    h.done()
}
