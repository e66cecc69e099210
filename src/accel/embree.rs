//! The Embree backend: the one file of the project with `unsafe`.
//!
//! Triangles are read from the scene's own buffers; quadrics are user geometry, whose callbacks run the shared Rust
//! routine. Objects are scenes of their own that the world's scene holds once for each instance; without instances there
//! is that one level alone. Which Embree it is, only ffi/embree.c knows.
#![allow(unsafe_code)]

use super::fit::padded_bounds;
use super::monitor::Monitor;
use super::options::{EmbreeError, EmbreeOptions, Quality};
use super::{Accel, Ray, levels, quadric};
use crate::scene::{Geometry, Instance, PrimId};
use glam::Vec3;
use std::ffi::{CStr, CString, c_char, c_void};
use std::marker::PhantomData;
use std::ptr::{NonNull, null_mut};
use std::sync::Arc;
use std::time::Duration;

/// Declarations of ffi/embree.h, made by bindgen for the installed library.
#[allow(
    missing_docs,
    non_camel_case_types,
    non_snake_case,
    non_upper_case_globals,
    dead_code,
    clippy::all
)]
pub(super) mod sys {
    include!(concat!(env!("OUT_DIR"), "/embree.rs"));
}

/// Hears which part of a build is done. It must not panic: C calls it.
pub(super) type Tell<'t> = &'t (dyn Fn(f64) + Sync);

/// An Embree device with its callbacks. Released on drop, after the scenes made of it, which share it.
pub(super) struct Device {
    raw: NonNull<sys::RTCDeviceTy>,
    monitor: Box<Monitor>,
    _ears: Box<sys::mlx_ears>,
}

impl Device {
    /// With so many threads to build; 0 is the library's choice.
    pub fn new(threads: usize) -> Result<Arc<Self>, EmbreeError> {
        let config = match threads {
            0 => CString::default(),
            n => CString::new(format!("threads={n}")).unwrap_or_default(),
        };
        // SAFETY: the string is terminated and outlives the call; a null device may be asked for its error.
        let raw = NonNull::new(unsafe { sys::rtcNewDevice(config.as_ptr()) })
            .ok_or_else(|| EmbreeError::NoDevice(unsafe { sys::rtcGetDeviceError(null_mut()) }))?;
        let monitor = Box::<Monitor>::default();
        let mut ears = Box::new(sys::mlx_ears {
            data: (&raw const *monitor).cast(),
            error: Some(on_error),
            memory: Some(on_memory),
        });
        // SAFETY: the device is alive; the callbacks take `data` for a Monitor and only share it. The boxes that hold it
        // and them are dropped after the device is released.
        unsafe { sys::mlx_listen(raw.as_ptr(), &raw mut *ears) }
        // Scenes of one build share it; it never goes to another thread without them.
        #[allow(clippy::arc_with_non_send_sync)]
        Ok(Arc::new(Self {
            raw,
            monitor,
            _ears: ears,
        }))
    }

    /// The library's own words where there are any, else `what`.
    fn refusal(&self, what: &str) -> EmbreeError {
        let told = self.monitor.check().err();
        told.unwrap_or_else(|| EmbreeError::Refused(what.to_owned()))
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: this is the one reference that `new` got.
        unsafe { sys::rtcReleaseDevice(self.raw.as_ptr()) }
    }
}

/// A scene of Embree's, released on drop.
pub(super) struct Scene<'g> {
    raw: NonNull<sys::RTCSceneTy>,
    // Dropped after the scene has been released.
    _user: Option<Box<sys::mlx_user>>,
    objects: Vec<Scene<'g>>,
    device: Arc<Device>,
    options: EmbreeOptions,
    /// It reads the geometry's buffers.
    _geometry: PhantomData<&'g Geometry>,
}

impl<'g> Scene<'g> {
    /// An empty scene, with these flags beside those that the options call for.
    pub fn new(
        device: &Arc<Device>,
        options: EmbreeOptions,
        more: sys::RTCSceneFlags,
    ) -> Result<Self, EmbreeError> {
        let (flags, quality) = levels::asked(options);
        // SAFETY: the device is alive.
        let raw = NonNull::new(unsafe { sys::rtcNewScene(device.raw.as_ptr()) })
            .ok_or_else(|| device.refusal("no scene"))?;
        // SAFETY: the scene is alive and not committed.
        unsafe {
            sys::rtcSetSceneFlags(raw.as_ptr(), flags | more);
            sys::rtcSetSceneBuildQuality(raw.as_ptr(), quality);
        }
        Ok(Self {
            raw,
            _user: None,
            objects: Vec::new(),
            device: device.clone(),
            options,
            _geometry: PhantomData,
        })
    }

    /// Puts in the triangles and quadrics of a part that `validate` found fit, each kind under its number, if there are
    /// any.
    pub fn fill(
        &mut self,
        part: &'g Geometry,
        [triangles, quadrics]: [u32; 2],
    ) -> Result<(), EmbreeError> {
        if !part.triangles.is_empty() {
            let raw = self.geometry(sys::RTC_GEOMETRY_TYPE_TRIANGLE)?;
            // SAFETY: Vec3 is three packed f32 and [u32; 3] three packed u32, so the formats and strides are theirs.
            // `validate` has seen that every index is below the count handed over and that one vertex more lies behind
            // the last, so 16-byte loads stay inside. The buffers are borrowed for longer than the scene lives.
            unsafe {
                sys::rtcSetSharedGeometryBuffer(
                    raw,
                    sys::RTC_BUFFER_TYPE_VERTEX,
                    0,
                    sys::RTC_FORMAT_FLOAT3,
                    part.positions.as_ptr().cast(),
                    0,
                    size_of::<Vec3>(),
                    part.positions.len().saturating_sub(1),
                );
                sys::rtcSetSharedGeometryBuffer(
                    raw,
                    sys::RTC_BUFFER_TYPE_INDEX,
                    0,
                    sys::RTC_FORMAT_UINT3,
                    part.triangles.as_ptr().cast(),
                    0,
                    size_of::<[u32; 3]>(),
                    part.triangles.len(),
                );
            }
            self.finish(raw, triangles)?;
        }
        if !part.quadrics.is_empty() {
            let raw = self.geometry(sys::RTC_GEOMETRY_TYPE_USER)?;
            let mut user = Box::new(sys::mlx_user {
                data: (&raw const *part).cast(),
                bounds: Some(quadric_bounds),
                hit: Some(quadric_hit),
            });
            // SAFETY: the geometry is alive; the user struct lies in a box that outlives the scene.
            unsafe { sys::mlx_set_user(raw, &raw mut *user, part.quadrics.len() as u32) }
            self._user = Some(user);
            self.finish(raw, quadrics)?;
        }
        Ok(())
    }

    /// An empty geometry.
    pub fn geometry(&self, kind: sys::RTCGeometryType) -> Result<sys::RTCGeometry, EmbreeError> {
        // SAFETY: the device is alive.
        let raw = unsafe { sys::rtcNewGeometry(self.device.raw.as_ptr(), kind) };
        match raw.is_null() {
            true => Err(self.device.refusal("no geometry")),
            false => Ok(raw),
        }
    }

    /// Commits a geometry that has its data, and attaches it under a number.
    fn finish(&self, raw: sys::RTCGeometry, id: u32) -> Result<(), EmbreeError> {
        // SAFETY: scene and geometry are alive; the scene keeps a reference of its own, and ours ends here.
        unsafe {
            if self.options.quality == Quality::Low {
                // The scene's own quality only chooses a tree of trees; Morton order is asked of each.
                sys::rtcSetGeometryBuildQuality(raw, sys::RTC_BUILD_QUALITY_LOW);
            }
            sys::rtcCommitGeometry(raw);
            sys::rtcAttachGeometryByID(self.raw.as_ptr(), raw, id);
            sys::rtcReleaseGeometry(raw);
        }
        self.device.monitor.check()
    }

    /// Takes committed scenes that are to stand in this one.
    pub fn hold(&mut self, objects: Vec<Self>) {
        self.objects = objects;
    }

    /// Lets the held scene of number `object` stand here by an affine map, given by its columns.
    pub fn place(&self, object: u32, map: [Vec3; 4], id: u32) -> Result<(), EmbreeError> {
        let raw = self.geometry(sys::RTC_GEOMETRY_TYPE_INSTANCE)?;
        let object = self.objects[object as usize].raw.as_ptr();
        // SAFETY: geometry and committed scene are alive, and `hold` keeps what that scene reads as long as this one.
        // The map is twelve floats, and copied.
        unsafe { sys::mlx_set_instance(raw, object, map.as_ptr().cast()) }
        self.finish(raw, id)
    }

    /// Builds the tree; `tell` hears from the library's threads which part is done.
    pub fn commit(&self, tell: Tell) -> Result<(), EmbreeError> {
        let mut teller = sys::mlx_teller {
            data: (&raw const tell).cast(),
            tell: Some(on_progress),
        };
        // SAFETY: the scene is alive; the buffers its geometries share are borrowed for longer than it lives. `tell` is
        // borrowed until the commit is over, and then the library forgets it; it may be called from any thread.
        unsafe { sys::mlx_commit(self.raw.as_ptr(), &raw mut teller) }
        self.device.monitor.check()
    }
}

impl Drop for Scene<'_> {
    fn drop(&mut self) {
        // SAFETY: this is the one reference that `new` got; the device is still alive.
        unsafe { sys::rtcReleaseScene(self.raw.as_ptr()) }
    }
}

/// Embree over a geometry.
pub struct Embree<'a> {
    /// Committed.
    pub(super) scene: Scene<'a>,
    split: sys::mlx_split,
    /// What `split` points to.
    _objects: Box<[u32]>,
    geometry: &'a Geometry,
    build_time: Duration,
}

// SAFETY: after rtcCommitScene a scene may be queried from any number of threads; nothing here changes it again, and
// what the callbacks share is itself Sync.
unsafe impl Send for Embree<'_> {}
// SAFETY: as above.
unsafe impl Sync for Embree<'_> {}

impl<'a> Embree<'a> {
    /// Over a committed scene of the geometry.
    pub(super) fn over(scene: Scene<'a>, geometry: &'a Geometry, build_time: Duration) -> Self {
        let triangles = |i: &Instance| geometry.objects[i.object as usize].triangles.len() as u32;
        let objects: Box<[u32]> = geometry.instances.iter().map(triangles).collect();
        Self {
            scene,
            split: sys::mlx_split {
                world: geometry.triangles.len() as u32,
                objects: objects.as_ptr(),
            },
            _objects: objects,
            geometry,
            build_time,
        }
    }

    /// Wall time of the build.
    pub fn build_time(&self) -> Duration {
        self.build_time
    }

    /// A property of the library or the machine.
    pub(super) fn property(&self, which: sys::RTCDeviceProperty) -> u32 {
        // SAFETY: the device is alive.
        unsafe { sys::rtcGetDeviceProperty(self.scene.device.raw.as_ptr(), which) as u32 }
    }

    /// What the library tells of itself while it works.
    pub(super) fn monitor(&self) -> &Monitor {
        &self.scene.device.monitor
    }

    /// The same queries in a bare C loop (kinds: 0 nearest, 1 occluded), to measure what everything around them costs.
    /// Returns the sum of the answers modulo 2⁶⁴: [`PrimId::raw`], `u64::MAX` for none, 0 or 1.
    ///
    /// With `flush` denormal numbers count as 0, as they do in single queries, but the mode is set once for all.
    pub fn replay(&self, rays: &[Ray], kinds: &[u8], flush: bool) -> u64 {
        assert_eq!(rays.len(), kinds.len());
        // SAFETY: both arrays hold `rays.len()` elements, and Ray has the layout of mlx_ray (asserted below).
        unsafe {
            sys::mlx_replay(
                self.scene.raw.as_ptr(),
                &raw const self.split,
                rays.as_ptr().cast(),
                kinds.as_ptr(),
                rays.len(),
                flush,
            )
        }
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
    fn nearest(&self, ray: &Ray) -> Option<PrimId> {
        let (scene, split) = (self.scene.raw.as_ptr(), &raw const self.split);
        // SAFETY: the scene is committed, the ray has the layout of mlx_ray and is only read.
        named(unsafe { sys::mlx_nearest(scene, split, (&raw const *ray).cast()) })
    }

    #[inline]
    fn occluded(&self, ray: &Ray) -> bool {
        // SAFETY: as in `nearest`.
        unsafe { sys::mlx_occluded(self.scene.raw.as_ptr(), (&raw const *ray).cast()) }
    }

    fn nearest_but(&self, ray: &Ray, but: [PrimId; 2]) -> Option<PrimId> {
        debug_assert!(self.geometry.leave_out);
        let (scene, split) = (self.scene.raw.as_ptr(), &raw const self.split);
        let (ray, but) = ((&raw const *ray).cast(), but.map(PrimId::raw));
        // SAFETY: as in `nearest`; `but` has two elements.
        named(unsafe { sys::mlx_nearest_but(scene, split, ray, but.as_ptr()) })
    }

    fn occluded_but(&self, ray: &Ray, but: [PrimId; 2]) -> bool {
        debug_assert!(self.geometry.leave_out);
        let (ray, but) = ((&raw const *ray).cast(), but.map(PrimId::raw));
        // SAFETY: as in `nearest_but`.
        unsafe { sys::mlx_occluded_but(self.scene.raw.as_ptr(), ray, but.as_ptr()) }
    }

    fn name(&self) -> String {
        format!("Embree {}", self.version())
    }

    fn memory_bytes(&self) -> usize {
        self.monitor().bytes()
    }
}

#[inline]
fn named(prim: u64) -> Option<PrimId> {
    (prim != sys::MLX_MISS).then_some(PrimId::from_raw(prim))
}

// The callbacks below are called from C: none of them can panic, and `extern "C"` would abort rather than unwind.

unsafe extern "C" fn on_error(data: *const c_void, code: u32, text: *const c_char) {
    // SAFETY: `data` is the Monitor given with this callback; `text` is null or a terminated string.
    let (monitor, text) = unsafe {
        let text = match text.is_null() {
            true => "no message".into(),
            false => CStr::from_ptr(text).to_string_lossy(),
        };
        (&*data.cast::<Monitor>(), text)
    };
    monitor.complain(format!("{text} (code {code})"));
}

unsafe extern "C" fn on_memory(data: *const c_void, bytes: i64) {
    // SAFETY: `data` is the Monitor given with this callback.
    unsafe { &*data.cast::<Monitor>() }.count(bytes as isize);
}

unsafe extern "C" fn on_progress(data: *const c_void, done: f64) {
    // SAFETY: `data` is the Tell given with this callback, alive until the commit is over.
    let tell = unsafe { &*data.cast::<Tell>() };
    tell(done);
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
