//! As much of Embree 4's C interface as the benchmark needs, loaded at run time.

use aonet_scene::Scene;
use glam::Vec3A;
use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW};
use std::ffi::c_void;
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};

type Handle = *mut c_void;

/// RTCRay.
#[repr(C, align(16))]
struct Ray {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

/// RTCRay16.
#[repr(C, align(64))]
struct Ray16 {
    origin: [[f32; 16]; 3],
    t_near: [f32; 16],
    direction: [[f32; 16]; 3],
    time: [f32; 16],
    t_far: [f32; 16],
    mask: [u32; 16],
    id: [u32; 16],
    flags: [u32; 16],
}

#[repr(C, align(64))]
struct Valid([i32; 16]);

/// A committed scene.
pub(crate) struct Embree {
    scene: Handle,
    occluded1: unsafe extern "C" fn(Handle, *mut Ray, *const c_void),
    occluded16: unsafe extern "C" fn(*const i32, Handle, *mut Ray16, *const c_void),
    /// The scene reads these buffers as long as it lives.
    _shared: (Vec<f32>, Vec<[u32; 3]>),
    _library: Library,
}

// From `rtcore_common.h`, `rtcore_buffer.h` and `rtcore_geometry.h`.
const QUALITY_HIGH: i32 = 2;
const TRIANGLES: i32 = 0;
const BUFFER_INDEX: i32 = 0;
const BUFFER_VERTEX: i32 = 1;
const FORMAT_UINT3: i32 = 0x5003;
const FORMAT_FLOAT3: i32 = 0x9003;

impl Embree {
    /// Loads the library from `folder` and builds a hierarchy of high quality over `triangles`.
    pub(crate) fn load(folder: &Path, triangles: &Scene) -> Self {
        let find = |start: &str| -> PathBuf {
            let files = std::fs::read_dir(folder).expect("EMBREE_DIR is a folder");
            let named = |p: &PathBuf| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with(start));
            files
                .flatten()
                .map(|f| f.path())
                .find(named)
                .unwrap_or_else(|| panic!("EMBREE_DIR has no {start}*"))
        };
        let vertices: Vec<f32> = triangles.position.iter().flat_map(|p| [p.x, p.y, p.z, 0.0]).collect();
        let indices = triangles.triangle.clone();
        // SAFETY: signatures as in Embree 4's headers; the shared buffers outlive the scene.
        unsafe {
            std::mem::forget(Library::open(Some(find("libtbb")), RTLD_NOW | RTLD_GLOBAL).expect("libtbb"));
            let library = Library::open(Some(find("libembree4")), RTLD_NOW).expect("libembree4");
            macro_rules! call {
                ($name:literal: ($($arg:expr => $type:ty),*) -> $ret:ty) => {
                    library.get::<unsafe extern "C" fn($($type),*) -> $ret>($name).expect("a function")($($arg),*)
                };
            }
            let device = call!(b"rtcNewDevice": (c"threads=1".as_ptr() => *const _) -> Handle);
            let scene = call!(b"rtcNewScene": (device => Handle) -> Handle);
            call!(b"rtcSetSceneBuildQuality": (scene => Handle, QUALITY_HIGH => i32) -> ());
            let geometry = call!(b"rtcNewGeometry": (device => Handle, TRIANGLES => i32) -> Handle);
            let share = *library
                .get::<unsafe extern "C" fn(Handle, i32, u32, i32, *const c_void, usize, usize, usize)>(
                    b"rtcSetSharedGeometryBuffer",
                )
                .expect("a function");
            let (v, i) = (vertices.as_ptr().cast(), indices.as_ptr().cast());
            share(geometry, BUFFER_VERTEX, 0, FORMAT_FLOAT3, v, 0, 16, vertices.len() / 4);
            share(geometry, BUFFER_INDEX, 0, FORMAT_UINT3, i, 0, 12, indices.len());
            call!(b"rtcCommitGeometry": (geometry => Handle) -> ());
            call!(b"rtcAttachGeometry": (scene => Handle, geometry => Handle) -> u32);
            call!(b"rtcCommitScene": (scene => Handle) -> ());
            let occluded1 = *library.get(b"rtcOccluded1").expect("a function");
            let occluded16 = *library.get(b"rtcOccluded16").expect("a function");
            Self { scene, occluded1, occluded16, _shared: (vertices, indices), _library: library }
        }
    }

    /// How many rays of `length` are blocked, asked one by one.
    pub(crate) fn occluded1(&self, origin: &[Vec3A], direction: &[Vec3A], length: f32) -> usize {
        let blocked = |(o, d): (&Vec3A, &Vec3A)| {
            let (origin, direction) = (o.to_array(), d.to_array());
            let mut ray =
                Ray { origin, t_near: 0.0, direction, time: 0.0, t_far: length, mask: !0, id: 0, flags: 0 };
            // SAFETY: the scene is committed; the ray is an RTCRay.
            unsafe { (self.occluded1)(self.scene, &mut ray, null()) };
            ray.t_far < 0.0
        };
        origin.iter().zip(direction).filter(|r| blocked(*r)).count()
    }

    /// The same, asked for sixteen neighbours at once.
    pub(crate) fn occluded16(&self, origin: &[Vec3A], direction: &[Vec3A], length: f32) -> usize {
        let blocked = |(o, d): (&[Vec3A], &[Vec3A])| {
            let transposed = |v: &[Vec3A]| [0, 1, 2].map(|a| std::array::from_fn(|k| v[k][a]));
            let mut ray = Ray16 {
                origin: transposed(o),
                t_near: [0.0; 16],
                direction: transposed(d),
                time: [0.0; 16],
                t_far: [length; 16],
                mask: [!0; 16],
                id: [0; 16],
                flags: [0; 16],
            };
            // SAFETY: the scene is committed; the rays are an RTCRay16.
            unsafe { (self.occluded16)(Valid([-1; 16]).0.as_ptr(), self.scene, &mut ray, null_mut()) };
            ray.t_far.iter().filter(|t| **t < 0.0).count()
        };
        origin.chunks_exact(16).zip(direction.chunks_exact(16)).map(blocked).sum()
    }
}
