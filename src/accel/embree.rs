//! The Embree backend: the one file of the project with `unsafe`.
//!
//! Triangles are Embree's geometry 0, read from the scene's own buffers; quadrics are geometry 1, whose callbacks run
//! the shared Rust routine. Which Embree it is, only ffi/embree.c knows.
#![allow(unsafe_code)]

use super::fit::{padded_bounds, validate};
use super::monitor::Monitor;
use super::options::{EmbreeError, EmbreeOptions, Quality};
use super::{Accel, Ray, quadric};
use crate::scene::Geometry;
use glam::Vec3;
use std::ffi::{CStr, CString, c_char, c_void};
use std::ptr::{NonNull, null_mut};
use std::time::{Duration, Instant};

/// Declarations of ffi/embree.h, made by bindgen for the installed library.
#[allow(
    missing_docs,
    non_camel_case_types,
    non_snake_case,
    non_upper_case_globals,
    dead_code,
    clippy::all
)]
mod sys {
    include!(concat!(env!("OUT_DIR"), "/embree.rs"));
}

/// Hears which part of a build is done. It must not panic: C calls it.
type Tell<'t> = &'t (dyn Fn(f64) + Sync);

/// An Embree device with its callbacks. Released on drop, after the scenes made of it.
struct Device {
    raw: NonNull<sys::RTCDeviceTy>,
    monitor: Box<Monitor>,
}

impl Device {
    fn new(threads: usize) -> Result<Self, EmbreeError> {
        let config = match threads {
            0 => CString::default(),
            n => CString::new(format!("threads={n}")).unwrap_or_default(),
        };
        // SAFETY: the string is terminated and outlives the call; a null device may be asked for its error.
        let raw = NonNull::new(unsafe { sys::rtcNewDevice(config.as_ptr()) })
            .ok_or_else(|| EmbreeError::NoDevice(unsafe { sys::rtcGetDeviceError(null_mut()) }))?;
        let monitor = Box::<Monitor>::default();
        let user = (&raw const *monitor).cast_mut().cast::<c_void>();
        // SAFETY: the device is alive; the callbacks take `user` for a Monitor, only share it, and the box that holds
        // it is dropped after the device is released.
        unsafe {
            sys::rtcSetDeviceErrorFunction(raw.as_ptr(), Some(on_error), user);
            sys::rtcSetDeviceMemoryMonitorFunction(raw.as_ptr(), Some(on_memory), user);
        }
        Ok(Self { raw, monitor })
    }

    fn property(&self, which: sys::RTCDeviceProperty) -> u32 {
        // SAFETY: the device is alive.
        unsafe { sys::rtcGetDeviceProperty(self.raw.as_ptr(), which) as u32 }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: this is the one reference that `new` got.
        unsafe { sys::rtcReleaseDevice(self.raw.as_ptr()) }
    }
}

/// Embree over a geometry.
pub struct Embree<'a> {
    scene: NonNull<sys::RTCSceneTy>,
    geometry: &'a Geometry,
    build_time: Duration,
    // Field order is drop order: the library lets go of the scene (in `drop`), the device, then what they point to.
    device: Device,
    _user: Box<sys::mlx_user>,
}

// SAFETY: after rtcCommitScene a scene may be queried from any number of threads; nothing here changes it again, and
// what the callbacks share is itself Sync.
unsafe impl Send for Embree<'_> {}
// SAFETY: as above.
unsafe impl Sync for Embree<'_> {}

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
        super::surface::prepare(geometry);
        let start = Instant::now();
        let device = Device::new(options.threads)?;
        let user = Box::new(sys::mlx_user {
            data: (&raw const *geometry).cast(),
            bounds: Some(quadric_bounds),
            hit: Some(quadric_hit),
        });
        // SAFETY: the device is alive.
        let scene = NonNull::new(unsafe { sys::rtcNewScene(device.raw.as_ptr()) })
            .ok_or_else(|| refusal(&device, "no scene"))?;
        let mut built = Self {
            scene,
            geometry,
            build_time: Duration::ZERO,
            device,
            _user: user,
        };
        built.fill(options, tell)?;
        built.build_time = start.elapsed();
        Ok(built)
    }

    fn fill(&mut self, options: EmbreeOptions, tell: Tell) -> Result<(), EmbreeError> {
        let scene = self.scene.as_ptr();
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
        // SAFETY: the scene is alive and not committed.
        unsafe {
            sys::rtcSetSceneFlags(scene, flags);
            sys::rtcSetSceneBuildQuality(scene, quality);
        }
        // Both geometries are attached in this order even when empty: 0 is the triangles, 1 the quadrics.
        self.attach(sys::RTC_GEOMETRY_TYPE_TRIANGLE, 0, options.quality)?;
        self.attach(sys::RTC_GEOMETRY_TYPE_USER, 1, options.quality)?;
        // SAFETY: the scene is alive; the buffers its geometries share are borrowed for longer than it lives. `tell` is
        // borrowed until the commit is over, and then the library forgets it; it may be called from any thread.
        unsafe {
            let user = (&raw const tell).cast_mut().cast::<c_void>();
            sys::rtcSetSceneProgressMonitorFunction(scene, Some(on_progress), user);
            sys::rtcCommitScene(scene);
            sys::rtcSetSceneProgressMonitorFunction(scene, None, null_mut());
        }
        self.device.monitor.check()
    }

    fn attach(
        &mut self,
        kind: sys::RTCGeometryType,
        expected: u32,
        quality: Quality,
    ) -> Result<(), EmbreeError> {
        // SAFETY: the device is alive.
        let raw = unsafe { sys::rtcNewGeometry(self.device.raw.as_ptr(), kind) };
        let raw = NonNull::new(raw).ok_or_else(|| refusal(&self.device, "no geometry"))?;
        let g = raw.as_ptr();
        let (positions, triangles) = (&self.geometry.positions, &self.geometry.triangles);
        // SAFETY: Vec3 is three packed f32 and [u32; 3] three packed u32, so the formats and strides are theirs.
        // `validate` has seen that every index is below the count handed over and that one vertex more lies behind
        // the last, so 16-byte loads stay inside. The scene keeps its own reference to the geometry. The user struct
        // lies in a box that outlives the scene.
        let id = unsafe {
            if kind == sys::RTC_GEOMETRY_TYPE_TRIANGLE {
                sys::rtcSetSharedGeometryBuffer(
                    g,
                    sys::RTC_BUFFER_TYPE_VERTEX,
                    0,
                    sys::RTC_FORMAT_FLOAT3,
                    positions.as_ptr().cast(),
                    0,
                    size_of::<Vec3>(),
                    positions.len().saturating_sub(1),
                );
                sys::rtcSetSharedGeometryBuffer(
                    g,
                    sys::RTC_BUFFER_TYPE_INDEX,
                    0,
                    sys::RTC_FORMAT_UINT3,
                    triangles.as_ptr().cast(),
                    0,
                    size_of::<[u32; 3]>(),
                    triangles.len(),
                );
            } else {
                let count = self.geometry.quadrics.len() as u32;
                sys::mlx_set_user(g, &raw mut *self._user, count);
            }
            if quality == Quality::Low {
                // The scene's own quality only chooses a tree of trees; Morton order is asked of each.
                sys::rtcSetGeometryBuildQuality(g, sys::RTC_BUILD_QUALITY_LOW);
            }
            sys::rtcCommitGeometry(g);
            let id = sys::rtcAttachGeometry(self.scene.as_ptr(), g);
            sys::rtcReleaseGeometry(g);
            id
        };
        self.device.monitor.check()?;
        if id != expected {
            return Err(EmbreeError::Refused(format!(
                "geometry {expected} was attached as {id}"
            )));
        }
        Ok(())
    }

    /// Wall time of the build.
    pub fn build_time(&self) -> Duration {
        self.build_time
    }

    /// The version of the library that runs, as "4.3.3".
    pub fn version(&self) -> String {
        let v = self.device.property(sys::RTC_DEVICE_PROPERTY_VERSION);
        format!("{}.{}.{}", v / 10_000, v / 100 % 100, v % 100)
    }

    /// The widest vectors the library traces with on this machine, as the name of an instruction set.
    pub fn isa(&self) -> &'static str {
        let native = |which| self.device.property(which) != 0;
        if native(sys::RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) {
            "AVX-512"
        } else if native(sys::RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) {
            "AVX"
        } else {
            "SSE"
        }
    }

    /// Most bytes the library held at once, while it built.
    pub fn peak_bytes(&self) -> usize {
        self.device.monitor.most_bytes()
    }

    /// What the library has complained about since the last time, if anything.
    pub fn check(&self) -> Result<(), EmbreeError> {
        self.device.monitor.check()
    }

    /// The same queries in a bare C loop (kinds: 0 nearest, 1 occluded), to measure what everything around them costs.
    /// Returns the sum of the answers: primitive number, `u32::MAX` for none, 0 or 1.
    ///
    /// With `flush` denormal numbers count as 0 meanwhile. That mode must not be on while Rust code runs, so there may be
    /// no quadrics, whose callbacks are Rust.
    pub fn replay(&self, rays: &[Ray], kinds: &[u8], flush: bool) -> u64 {
        assert_eq!(rays.len(), kinds.len());
        assert!(!flush || self.geometry.quadrics.is_empty());
        let split = self.geometry.triangles.len() as u32;
        // SAFETY: both arrays hold `rays.len()` elements, and Ray has the layout of mlx_ray (asserted below).
        unsafe {
            sys::mlx_replay(
                self.scene.as_ptr(),
                split,
                rays.as_ptr().cast(),
                kinds.as_ptr(),
                rays.len(),
                flush,
            )
        }
    }
}

impl Drop for Embree<'_> {
    fn drop(&mut self) {
        // SAFETY: this is the one reference that `new` got; the device is still alive.
        unsafe { sys::rtcReleaseScene(self.scene.as_ptr()) }
    }
}

// A Ray is handed to C as it is.
const _: () = {
    assert!(size_of::<Ray>() == size_of::<sys::mlx_ray>());
    assert!(align_of::<Ray>() == align_of::<sys::mlx_ray>());
    assert!(std::mem::offset_of!(Ray, o) == std::mem::offset_of!(sys::mlx_ray, o));
    assert!(std::mem::offset_of!(Ray, d) == std::mem::offset_of!(sys::mlx_ray, d));
    assert!(std::mem::offset_of!(Ray, t_max) == std::mem::offset_of!(sys::mlx_ray, t_max));
};

impl Accel for Embree<'_> {
    fn geometry(&self) -> &Geometry {
        self.geometry
    }

    #[inline]
    fn nearest(&self, ray: &Ray) -> Option<u32> {
        let split = self.geometry.triangles.len() as u32;
        // SAFETY: the scene is committed, the ray has the layout of mlx_ray and is only read.
        let prim =
            unsafe { sys::mlx_nearest(self.scene.as_ptr(), split, (&raw const *ray).cast()) };
        (prim != sys::MLX_MISS).then_some(prim)
    }

    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        // SAFETY: as in `nearest`.
        unsafe { sys::mlx_occluded(self.scene.as_ptr(), (&raw const *ray).cast()) }
    }

    fn name(&self) -> String {
        format!("Embree {}", self.version())
    }

    fn memory_bytes(&self) -> usize {
        self.device.monitor.bytes()
    }
}

/// The library's own words where there are any, else `what`.
fn refusal(device: &Device, what: &str) -> EmbreeError {
    device
        .monitor
        .check()
        .err()
        .unwrap_or_else(|| EmbreeError::Refused(what.to_owned()))
}

// The callbacks below are called from C: none of them can panic, and `extern "C"` would abort rather than unwind.

unsafe extern "C" fn on_error(user: *mut c_void, code: sys::RTCError, text: *const c_char) {
    // SAFETY: `user` is the Monitor given with this callback; `text` is null or a terminated string.
    let (monitor, text) = unsafe {
        let text = match text.is_null() {
            true => "no message".into(),
            false => CStr::from_ptr(text).to_string_lossy(),
        };
        (&*user.cast::<Monitor>(), text)
    };
    monitor.complain(format!("{text} (code {code})"));
}

unsafe extern "C" fn on_memory(user: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: `user` is the Monitor given with this callback.
    let monitor = unsafe { &*user.cast::<Monitor>() };
    monitor.count(bytes);
    true
}

unsafe extern "C" fn on_progress(user: *mut c_void, done: f64) -> bool {
    // SAFETY: `user` is the Tell given with this callback, alive until the commit is over.
    let tell = unsafe { &*user.cast::<Tell>() };
    tell(done);
    true
}

unsafe extern "C" fn quadric_bounds(data: *const c_void, index: u32, out: *mut f32) {
    // SAFETY: `data` is the geometry given to mlx_set_user, `out` has room for six floats.
    let (geometry, out) = unsafe { (&*data.cast::<Geometry>(), &mut *out.cast::<[f32; 6]>()) };
    let (lo, hi) = padded_bounds(geometry, geometry.triangles.len() as u32 + index);
    *out = [lo.x, lo.y, lo.z, hi.x, hi.y, hi.z];
}

unsafe extern "C" fn quadric_hit(data: *const c_void, index: u32, ray: *const sys::mlx_ray) -> f32 {
    // SAFETY: `data` is the geometry given to mlx_set_user; the ray is alive and has the layout of Ray.
    let (geometry, ray) = unsafe { (&*data.cast::<Geometry>(), &*ray.cast::<Ray>()) };
    let q = geometry.quadrics.get(index as usize);
    q.and_then(|q| quadric::intersect(q, ray)).unwrap_or(-1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_librarys_own_words_reach_the_caller() {
        let geometry = super::super::testing::icosphere(0);
        let mut built = Embree::new(&geometry, EmbreeOptions::default()).expect("builds");
        // No such kind of geometry.
        let Err(EmbreeError::Refused(text)) = built.attach(9999, 2, Quality::High) else {
            panic!("accepted");
        };
        assert!(text.contains("code"), "{text}");
        assert_eq!(built.check(), Ok(()));
    }
}
