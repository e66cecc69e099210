//! What is there: geometry, materials, lights, camera and spectra as plain data.

pub mod camera;
pub mod flatten;
pub mod geometry;
pub mod instance;
pub mod light;
pub mod load;
pub mod material;
pub mod source;
pub mod spectrum;
pub mod subset;
pub mod texture;

pub use camera::Camera;
pub use geometry::{Facet, Geometry, NONE, Quadric, SLIVER, Shape};
pub use instance::{Instance, PrimId};
pub use light::Light;
pub use load::{LoadOptions, SceneError, load_scene};
pub use material::Material;
pub use source::{Source, Sources};

/// Pixel reconstruction filter, as pbrt-v4's `PixelFilter` names them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FilterKind {
    /// Constant over the footprint.
    Box,
    /// Tent.
    Triangle,
    /// Gaussian of the given standard deviation, minus its value at the radius.
    Gaussian {
        /// Standard deviation in pixels.
        sigma: f32,
    },
    /// Mitchell and Netravali's cubic.
    Mitchell {
        /// Parameter B.
        b: f32,
        /// Parameter C.
        c: f32,
    },
}

/// A pixel filter with its radii in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSettings {
    /// Which function.
    pub kind: FilterKind,
    /// Half width, half height in pixels.
    pub radius: [f32; 2],
}

/// The three integrators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntegratorKind {
    /// Path tracing.
    Pt,
    /// Bidirectional path tracing.
    Bdpt,
    /// Metropolis light transport.
    Mlt,
}

/// What the scene file's Film, Integrator and Sampler directives ask for: the defaults of a render.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Integrator, where the file names one that exists here; else `None`.
    pub integrator: Option<IntegratorKind>,
    /// Most scattering events on a path: a path has at most `max_depth + 1` edges (pbrt's `maxdepth`).
    pub max_depth: u32,
    /// Sampler `pixelsamples`.
    pub spp: Option<u32>,
    /// pbrt's `mutationsperpixel`.
    pub mutations: Option<u32>,
    /// Film file name.
    pub filename: Option<String>,
    /// Pixel filter.
    pub filter: FilterSettings,
    /// Factor on the image: pbrt's film `iso`/100 · shutter · …; 1 by default.
    pub film_scale: f32,
}

/// A scene ready to be traced. World coordinates are recentred: true world = `origin` + stored.
#[derive(Clone, Debug)]
pub struct Scene {
    /// World-space primitives.
    pub geometry: Geometry,
    /// Materials by index.
    pub materials: Vec<Material>,
    /// Images of textures and environment lights by index.
    pub images: Vec<texture::Image>,
    /// One entry a light; an emissive mesh has one a triangle.
    pub lights: Vec<Light>,
    /// The camera, with resolution and crop.
    pub camera: Camera,
    /// Defaults the file gives.
    pub settings: RenderSettings,
    /// The point of the true world at the stored origin.
    pub origin: glam::DVec3,
    /// Warnings of the loader, ready to print.
    pub warnings: Vec<String>,
    /// Hash of everything that can change the image.
    pub hash: u64,
    /// Where materials, shapes, lights and the camera stand in the scene file.
    pub sources: Sources,
    /// Files it was read from.
    pub files: Vec<std::path::PathBuf>,
}

impl Scene {
    /// The largest coordinate of anything that rays may begin or end at.
    pub fn reach(&self) -> f64 {
        let lamps = self.lights.iter().filter_map(|l| match l {
            Light::Point { position, .. } | Light::Spot { position, .. } => Some(*position),
            _ => None,
        });
        let corners = self.geometry.bounds().into_iter().flat_map(|b| [b.0, b.1]);
        let all = corners.chain(lamps).chain([self.camera.position]);
        all.fold(0.0, |far, p| far.max(p.abs().max_element() as f64))
    }

    /// Centre and radius of a sphere around all geometry (radius at least the smallest normal float).
    pub fn bounding_sphere(&self) -> (glam::Vec3, f32) {
        self.geometry.bounding_sphere()
    }
}
