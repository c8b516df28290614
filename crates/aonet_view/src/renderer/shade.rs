//! Lighting, tone mapping, and the slider between two methods: one pass.

use super::device::{Cover, Gpu, bytes};
use super::frame::{FrameParams, Show};
use super::method::Method;
use super::occlusion::Occlusion;
use super::stopwatch::Stopwatch;
use super::targets::{self, Targets};
use aonet::Margin;
use aonet::gpu::wgpu;
use aonet::internals::gpu::bind::{self, TEXTURE, UNIFORM};
use aonet::metrics::ERROR_SCALE;

/// Bytes of the struct `Shade` of `shade.wgsl`.
const SHADE_BYTES: u64 = 96;

/// Draws the picture.
#[derive(Debug)]
pub(super) struct ShadePass {
    gpu: Gpu,
    cover: Cover,
    shade: wgpu::Buffer,
}

impl ShadePass {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let mut bindings = [TEXTURE; 11];
        bindings[0] = UNIFORM;
        let cover = gpu.cover(("shade", &source()), &bindings, targets::PICTURE);
        let shade = gpu.buffer("shade", SHADE_BYTES, wgpu::BufferUsages::UNIFORM);
        Self { gpu: gpu.clone(), cover, shade }
    }

    pub(super) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (targets, occlusion): (&Targets, &Occlusion),
        frame: &FrameParams,
        watch: Option<&mut Stopwatch>,
    ) {
        self.gpu.queue.write_buffer(&self.shade, 0, &shade_bytes(frame, targets.window.margin()));
        let [first, second] = frame.methods.map(|method| &occlusion.visibility(method).view);
        let reference = &occlusion.visibility(Method::Reference).view;
        let [normal, depth, albedo] = [&targets.normal, &targets.depth, &targets.albedo].map(|t| &t.view);
        // Only pictures of the second layer read its normals, and their frames have some.
        let second_normal = targets.second.as_ref().map_or(normal, |second| &second.normal.view);
        let shares = &occlusion.shares().view;
        // Without the switch, light comes from about the normal, even where a session with bent normals is still there.
        let [first_bent, second_bent] = match frame.shows_bent_normals() {
            true => frame.methods.map(|method| &occlusion.bent_normals(method).view),
            false => [&occlusion.bent_normals(Method::Off).view; 2],
        };
        let views =
            [normal, depth, albedo, first, second, reference, second_normal, shares, first_bent, second_bent];
        let views = views.map(wgpu::BindingResource::TextureView);
        let resources = [self.shade.as_entire_binding()].into_iter().chain(views);
        // Created for every frame, because the methods' textures can change.
        let group = bind::group(&self.gpu.device, "shade", &self.cover.layout, resources);
        let clock = watch.and_then(|watch| watch.pass("lighting"));
        self.cover.encode(encoder, &group, &targets.picture.view, clock.as_ref());
    }
}

/// The shader.
pub(super) fn source() -> String {
    format!("const ERROR_SCALE: f32 = {ERROR_SCALE:?};\n{}", include_str!("shade.wgsl"))
}

/// The struct `Shade` of the shader.
fn shade_bytes(frame: &FrameParams, margin: Margin) -> Vec<u8> {
    let camera = &frame.camera;
    let world_from_view = camera.view_from_world().matrix3.transpose();
    let columns = world_from_view.to_cols_array_2d().map(|[x, y, z]| [x, y, z, 0.0]);
    let size = [camera.width() as f32, camera.height() as f32];
    let ([x, y], [focal_x, focal_y]) = (camera.centre_px(), camera.focal_px());
    // Parallel rays have one direction.
    let per_pixel = if camera.is_perspective() { [1.0 / focal_x, 1.0 / focal_y] } else { [0.0; 2] };
    let half_image = [0.5 * per_pixel[0] * size[0], 0.5 * per_pixel[1] * size[1]];
    let middle = [per_pixel[0] * (0.5 * size[0] - x), per_pixel[1] * (y - 0.5 * size[1])];
    let split = (frame.split * camera.width() as f32).round() as u32;
    let show = match frame.show {
        Show::Shaded => 0,
        Show::Visibility => 1,
        Show::Normals => 2,
        Show::Error => 3,
        Show::Second => 4,
        Show::Shares => 5,
        Show::Bent => 6,
    };
    let words = [camera.width() as u32, camera.height() as u32, split, show];
    let mut all = bytes(columns.into_iter().flatten().chain(half_image));
    all.extend(words.into_iter().flat_map(u32::to_le_bytes));
    all.extend(bytes(middle));
    all.extend([margin.x as u32, margin.y as u32].into_iter().flat_map(u32::to_le_bytes));
    all.resize(SHADE_BYTES as usize, 0);
    all
}
