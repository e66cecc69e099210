//! Which scenes Embree is given: one for the world, and one for each object that stands in it.

use super::embree::{Device, Scene, Tell, sys};
use super::fit::validate;
use super::{Embree, EmbreeError, EmbreeOptions, Quality, surface};
use crate::scene::{Geometry, Instance};
use std::sync::Arc;
use std::time::Instant;

impl<'a> Embree<'a> {
    /// Builds over all primitives of `geometry`.
    pub fn new(geometry: &'a Geometry, options: EmbreeOptions) -> Result<Self, EmbreeError> {
        Self::build(geometry, options, &|_| {})
    }

    /// The same; `tell` hears from the library's threads which part is done, from 0 to 1.
    pub fn build(
        geometry: &'a Geometry,
        options: EmbreeOptions,
        tell: Tell,
    ) -> Result<Self, EmbreeError> {
        validate(geometry).map_err(EmbreeError::Geometry)?;
        surface::prepare(geometry);
        let start = Instant::now();
        let device = Device::new(options.threads)?;
        let scene = scenes(geometry, &device, options, tell)?;
        Ok(Self::over(scene, geometry, start.elapsed()))
    }

    /// The version of the library that runs, as "4.3.3".
    pub fn version(&self) -> String {
        let v = self.property(sys::RTC_DEVICE_PROPERTY_VERSION);
        format!("{}.{}.{}", v / 10_000, v / 100 % 100, v % 100)
    }

    /// The widest vectors the library traces with on this machine, as the name of an instruction set.
    pub fn isa(&self) -> &'static str {
        if self.property(sys::RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0 {
            "AVX-512"
        } else if self.property(sys::RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0 {
            "AVX"
        } else {
            "SSE"
        }
    }

    /// Most bytes the library held at once, while it built.
    pub fn peak_bytes(&self) -> usize {
        self.monitor().most_bytes()
    }

    /// What the library has complained about since the last time, if anything.
    pub fn check(&self) -> Result<(), EmbreeError> {
        self.monitor().check()
    }
}

/// The committed scene of the world.
fn scenes<'g>(
    geometry: &'g Geometry,
    device: &Arc<Device>,
    options: EmbreeOptions,
    tell: Tell,
) -> Result<Scene<'g>, EmbreeError> {
    // Progress counts what trees are built over.
    let flags = if geometry.leave_out {
        sys::MLX_FILTERED
    } else {
        sys::RTC_SCENE_FLAG_NONE
    };
    let primitives: usize = geometry.parts().map(Geometry::prim_count).sum();
    let whole = (primitives + geometry.instances.len()).max(1) as f64;
    let mut done = 0;
    let mut objects = Vec::with_capacity(geometry.objects.len());
    for object in &geometry.objects {
        let mut scene = Scene::new(device, options, flags)?;
        let ids = [sys::MLX_OBJECT_TRIANGLES, sys::MLX_OBJECT_QUADRICS];
        scene.fill(object, ids)?;
        let count = object.prim_count();
        scene.commit(&|x| tell((done as f64 + x * count as f64) / whole))?;
        done += count;
        objects.push(scene);
    }
    let mut world = Scene::new(device, options, flags)?;
    world.fill(geometry, [sys::MLX_TRIANGLES, sys::MLX_QUADRICS])?;
    world.hold(objects);
    for (i, instance) in geometry.instances.iter().enumerate() {
        let Instance {
            object,
            linear: m,
            translation,
            ..
        } = *instance;
        let map = [m.x_axis, m.y_axis, m.z_axis, translation];
        world.place(object, map, sys::MLX_INSTANCES + i as u32)?;
    }
    let rest = whole - done as f64;
    world.commit(&|x| tell((done as f64 + x * rest) / whole))?;
    Ok(world)
}

/// Flags and quality of a scene.
pub(super) fn asked(options: EmbreeOptions) -> (sys::RTCSceneFlags, sys::RTCBuildQuality) {
    let quality = match options.quality {
        Quality::Low => sys::RTC_BUILD_QUALITY_LOW,
        Quality::Medium => sys::RTC_BUILD_QUALITY_MEDIUM,
        Quality::High => sys::RTC_BUILD_QUALITY_HIGH,
    };
    let mut flags = sys::RTC_SCENE_FLAG_NONE;
    if options.robust {
        flags |= sys::RTC_SCENE_FLAG_ROBUST;
    }
    if options.compact {
        flags |= sys::RTC_SCENE_FLAG_COMPACT;
    }
    (flags, quality)
}
