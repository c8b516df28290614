//! Frame files: one OpenEXR image per frame.
//!
//! | channel | meaning |
//! |---|---|
//! | `normal.X/Y/Z` | half; unit shading normal in view space, zero on the background |
//! | `depth` | float; distance along -Z (world units), infinite on the background |
//! | `mask` | half; 1 where there is geometry, else 0 |
//! | `geo_normal.X/Y/Z` | half, optional; geometric normal in view space |
//! | `ao` | half, optional; visibility; 1 in the guard band |
//! | `bent_normal.X/Y/Z` | half, optional; bent normals in view space, zero on the background; see [`crate::bent_file`] |
//! | `second.depth` | float, optional; depth of a second layer, infinite where there is none |
//! | `second.normal.X/Y/Z` | half, optional; normals of the second layer, view space |
//!
//! The display window is the picture. What the data window has around it is its guard band.
//!
//! The camera is JSON text in the attribute `aonet:view` (a [`View`]) or, for a frame without one,
//! `aonet:camera`; the AO radius is the float `aonet:radius`. A file of Blender may have the camera in its note. Files of other programs are read, too: see
//! [`Frame::load`].

mod camera;
pub(crate) mod channels;
mod normals;
mod second;

use crate::bent_file;
use crate::exr_file::{self, ExrFile, Plane};
use aonet::{AoImage, AoParams, BentNormals, GBuffer, Window};
use aonet_scene::{Error, Result, View, atomic_file};
use channels::Layout;
use exr::image::FlatSamples;
use half::f16;
use std::path::Path;

pub use normals::NormalSpace;

/// A G-buffer with the other contents of its file.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Depth and shading normals, view space.
    pub gbuffer: GBuffer<'static>,
    /// HxW geometric normals, view space; zero on the background.
    pub geo_normal: Option<Vec<[f32; 3]>>,
    /// Reference AO.
    pub ao: Option<AoImage>,
    /// AO radius (world units) that belongs to the frame.
    pub radius: Option<f32>,
    /// The view of the frame, if known.
    pub view: Option<View>,
}

/// What to read of a frame.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    /// Everything.
    All,
    /// Depth and normals, of both layers.
    GBuffer,
}

/// A frame, and whether the camera's position in the world is known.
struct Posed {
    frame: Frame,
    has_pose: bool,
}

/// Values that a frame's file lacks or has wrong.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrameHints {
    /// A view: camera and radius. Required if normals are in world space.
    pub view: Option<View>,
    /// Vertical field of view (degrees).
    pub fov_y_deg: Option<f32>,
    /// AO radius (world units).
    pub radius: Option<f32>,
    /// Space of the normals; by default derived from the channel names.
    pub normals: Option<NormalSpace>,
}

impl Frame {
    /// Reads a frame. `hints` take precedence over the file.
    ///
    /// Accepted channel names, in any case, each also behind a layer name and a dot:
    ///
    /// | quantity | names |
    /// |---|---|
    /// | normal | `normal`, `normals` or `N` with `.X/.Y/.Z` or `.R/.G/.B` |
    /// | depth | `depth`; `Z` (only without a layer); `depth` or `Z` with `.Z`, `.V`, `.R`, `.Y` or `.depth` |
    /// | AO, optional | `ao`; `ao` or `ambient occlusion` with `.R`, `.V`, `.Y` or `.ao` |
    /// | mask, optional | `mask` |
    ///
    /// Of several layers the first with a normal (in the file's order) is read. Normals behind a
    /// layer name are in Blender's world space, so [`FrameHints::view`] is required.
    ///
    /// Background is where `mask` is below one half, or the depth is infinite or at least 1e9 or, in half
    /// floats, 65504; and without a mask also where the normal is zero. Pixels outside the data window are
    /// background. Pixels that the data window has on both sides of the display window are a guard band; what one side has more
    /// than the other is dropped.
    ///
    /// # Errors
    /// Names the file, what was expected and what was found: a channel or the camera is missing, a depth
    /// or a normal is invalid, the view has another size, or the bytes are no such image.
    pub fn load(path: &Path, hints: &FrameHints) -> Result<Self> {
        Self::read_files(path, None, hints, Part::All)
    }

    /// [`Frame::load`] with the visible surfaces of another file as second layer, instead of the frame's own: a frame of the
    /// same camera and scene without the objects in front. That file needs a depth; normals are optional.
    /// Where both files show the same surface, depths may differ by rounding.
    ///
    /// # Errors
    /// As [`Frame::load`]; and when the other file has no depth, is of another size, shows something in front of the first
    /// layer, or has a depth or a normal that is invalid.
    pub fn load_with_second(path: &Path, second: &Path, hints: &FrameHints) -> Result<Self> {
        Self::read_files(path, Some(second), hints, Part::All)
    }

    /// [`Frame::load`], or [`Frame::load_with_second`], without geometric normals and AO: methods read neither.
    ///
    /// # Errors
    /// As they, but for what is not read.
    pub fn load_gbuffer(path: &Path, second: Option<&Path>, hints: &FrameHints) -> Result<Self> {
        Self::read_files(path, second, hints, Part::GBuffer)
    }

    fn read_files(path: &Path, second: Option<&Path>, hints: &FrameHints, part: Part) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(Error::io(path))?;
        let Posed { frame, has_pose } = Self::read(&bytes, hints, part).map_err(Error::in_file(path))?;
        let Some(second) = second else { return Ok(frame) };
        let bytes = std::fs::read(second).map_err(Error::io(second))?;
        let layer = second::read(&bytes, (&frame.gbuffer, has_pose), hints);
        let with_second = layer.and_then(|layer| frame.gbuffer.with_second(layer));
        Ok(Self { gbuffer: with_second.map_err(Error::in_file(second))?, ..frame })
    }

    /// [`Frame::load`] from the bytes of a file.
    ///
    /// # Errors
    /// As [`Frame::load`], without the file's name.
    pub fn from_bytes(bytes: &[u8], hints: &FrameHints) -> aonet::Result<Self> {
        Ok(Self::read(bytes, hints, Part::All)?.frame)
    }

    fn read(bytes: &[u8], hints: &FrameHints, part: Part) -> aonet::Result<Posed> {
        let file = ExrFile::open(bytes)?;
        let layout = Layout::find(file.channels())?;
        let layout = if part == Part::GBuffer { layout.of_gbuffer() } else { layout };
        let seen = camera::resolve(&file, hints)?;
        let space = hints.normals.unwrap_or(layout.space);
        normals::check_pose(space, seen.has_pose)?;
        let window = file.window();
        let camera = seen.camera.with_margin(window.margin())?;
        let mut pixels = layout.read(file, window)?;
        pixels.find_background();
        normals::check_not_encoded(&pixels.normal, &pixels.depth)?;
        let to_view = |n| normals::to_view(n, space, &seen.camera, &pixels.depth);
        let (normal, geo_normal) = (to_view(pixels.normal), pixels.geo_normal.map(to_view));
        let gbuffer = GBuffer::new(camera, pixels.depth, normal)?.with_margin(window.margin())?;
        let gbuffer = match pixels.second {
            Some(second) => gbuffer.with_second(second)?,
            None => gbuffer,
        };
        if let Some(geo_normal) = &geo_normal {
            normals::check_finite(geo_normal, gbuffer.depth(), gbuffer.width())?;
        }
        let ao = pixels.ao.map(|mut ao| {
            (0..ao.len()).filter(|&i| !gbuffer.is_foreground(i)).for_each(|i| ao[i] = 1.0);
            AoImage::new(window.size(), window.cropped(ao))
        });
        let radius = seen.radius.map(AoParams::new).transpose()?.map(|params| params.radius());
        let frame = Self { gbuffer, geo_normal, ao: ao.transpose()?, radius, view: seen.view };
        Ok(Posed { frame, has_pose: seen.has_pose })
    }

    /// Writes a frame under a temporary name, then renames it.
    ///
    /// # Errors
    /// When the file cannot be written; no partial file remains.
    pub fn save(&self, path: &Path) -> Result<()> {
        atomic_file::write(path, &self.to_bytes().map_err(Error::in_file(path))?)
    }

    /// [`Frame::save`] with bent normals of the picture; zero in the guard band.
    ///
    /// # Errors
    /// As [`Frame::save`], and when the bent normals have another size than the picture.
    pub fn save_with_bent_normals(&self, path: &Path, bent: &BentNormals) -> Result<()> {
        let window = self.gbuffer.window();
        window.size().expect("bent normals of a frame", bent.size())?;
        let planes = [0, 1, 2].map(|c| {
            let picture: Vec<f32> = bent.directions().iter().map(|direction| direction[c]).collect();
            let samples = half_samples(guarded(window, &picture, 0.0).into_iter());
            Plane { name: bent_file::CHANNELS[c], samples }
        });
        atomic_file::write(path, &self.encoded(planes.into()).map_err(Error::in_file(path))?)
    }

    /// The bytes that [`Frame::save`] writes; equal frames give equal bytes.
    ///
    /// # Errors
    /// When `geo_normal` or `ao` is not of the G-buffer's size.
    pub fn to_bytes(&self) -> aonet::Result<Vec<u8>> {
        self.encoded(vec![])
    }

    /// The bytes of a file with further planes.
    fn encoded(&self, further: Vec<Plane>) -> aonet::Result<Vec<u8>> {
        let (window, pixels) = (self.gbuffer.window(), self.gbuffer.size().pixels());
        let geo_len = self.geo_normal.as_ref().map_or(pixels, Vec::len);
        if geo_len != pixels {
            return Err(aonet::Error::size("geometric normals", pixels, geo_len));
        }
        if let Some(ao) = &self.ao {
            window.size().expect("frame AO", ao.size())?;
        }
        let mask = (0..pixels).map(|i| f16::from_f32(f32::from(u8::from(self.gbuffer.is_foreground(i)))));
        let mut planes = vec![
            Plane { name: "depth", samples: FlatSamples::F32(self.gbuffer.depth().to_vec()) },
            Plane { name: "mask", samples: FlatSamples::F16(mask.collect()) },
        ];
        planes.extend(vector_planes(["normal.X", "normal.Y", "normal.Z"], self.gbuffer.normal()));
        if let Some(normal) = &self.geo_normal {
            planes.extend(vector_planes(["geo_normal.X", "geo_normal.Y", "geo_normal.Z"], normal));
        }
        if let Some(ao) = &self.ao {
            planes.push(Plane {
                name: "ao",
                samples: half_samples(guarded(window, ao.visibility(), 1.0).into_iter()),
            });
        }
        if let Some(second) = self.gbuffer.second() {
            planes.push(Plane { name: "second.depth", samples: FlatSamples::F32(second.depth.to_vec()) });
            let names = ["second.normal.X", "second.normal.Y", "second.normal.Z"];
            planes.extend(second.normal.iter().flat_map(|normal| vector_planes(names, normal)));
        }
        planes.extend(further);
        let camera = camera::attribute(self)?;
        exr_file::encode_frame(window, planes, camera, self.radius.map(|r| (camera::RADIUS, r)))
    }
}

/// An image of the picture with a value in the guard band.
fn guarded(window: Window, picture: &[f32], beside: f32) -> Vec<f32> {
    let (buffer, margin, width) = (window.buffer_size(), window.margin(), window.size().width());
    let mut values = vec![beside; buffer.pixels()];
    for (row, line) in values.chunks_exact_mut(buffer.width()).skip(margin.y).zip(picture.chunks_exact(width))
    {
        row[margin.x..margin.x + width].copy_from_slice(line);
    }
    values
}

fn half_samples(values: impl Iterator<Item = f32>) -> FlatSamples {
    FlatSamples::F16(values.map(f16::from_f32).collect())
}

fn vector_planes(names: [&'static str; 3], vectors: &[[f32; 3]]) -> [Plane; 3] {
    [0, 1, 2].map(|c| Plane { name: names[c], samples: half_samples(vectors.iter().map(|v| v[c])) })
}
