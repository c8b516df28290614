//! Runs the programs of `aonet` on wgpu 29: a network or a classic method as passes in your command encoder.
//!
//! It has the same verbs as `aonet::gpu::Session`, which is on wgpu 30: [`Session::new`], [`Session::bind`], [`Session::encode`]. A
//! [`Program`] is made without wgpu, by `aonet::net::gpu::Network` or `aonet::search::gpu::Method`.

mod bind;

pub use wgpu;

use aonet::gpu::program::{Binding, Usage};
use aonet::gpu::{FrameNumbers, Layers, Program};
use aonet::{Error, Margin, Result};
use bind::{empty, group, layout, pipeline_layout, scoped};

/// A program on a device, for frames of its size.
#[derive(Debug)]
pub struct Session {
    device: wgpu::Device,
    queue: wgpu::Queue,
    program: Program,
    output: wgpu::TextureFormat,
    frame_layout: wgpu::BindGroupLayout,
    cleared: Vec<wgpu::Buffer>,
    passes: Vec<Pass>,
    image: (wgpu::RenderPipeline, wgpu::BindGroup),
}

#[derive(Debug)]
struct Pass {
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
    sees_frame: bool,
    workgroups: [u32; 3],
}

/// Views of textures of the program's size, one sample a pixel.
#[derive(Debug, Clone, Copy)]
pub struct FrameViews<'a> {
    /// Normals in the program's encoding.
    pub normal: &'a wgpu::TextureView,
    /// Depth in the program's encoding, the depth aspect only.
    pub depth: &'a wgpu::TextureView,
    /// The second layer of depth, for programs of two layers.
    pub second: Option<&'a wgpu::TextureView>,
    /// Visibility comes here; usage `RENDER_ATTACHMENT`. If it is smaller than the program, the rest is a guard band.
    pub visibility: &'a wgpu::TextureView,
}

/// Textures of one camera, and the memory of its numbers.
#[derive(Debug)]
pub struct BoundFrame {
    margin: Margin,
    frame: wgpu::Buffer,
    group: wgpu::BindGroup,
    visibility: wgpu::TextureView,
}

impl Session {
    /// Allocates and compiles all that the program needs. Visibility is a texture of the format `output`.
    ///
    /// # Errors
    /// When the device lacks half floats, limits or memory for the program, or a shader is not valid.
    pub fn new(
        on: (&wgpu::Device, &wgpu::Queue),
        program: Program,
        output: wgpu::TextureFormat,
    ) -> Result<Self> {
        scoped(on.0, "session", || Self::make(on, program, output))
    }

    fn make(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        program: Program,
        output: wgpu::TextureFormat,
    ) -> Self {
        let buffers: Vec<_> = program
            .buffers()
            .iter()
            .map(|buffer| {
                let usage = match buffer.usage {
                    Usage::Uniform => wgpu::BufferUsages::UNIFORM,
                    Usage::Storage => wgpu::BufferUsages::STORAGE,
                };
                let made = empty(device, &buffer.label, buffer.bytes, usage);
                if let Some(contents) = &buffer.contents {
                    queue.write_buffer(&made, 0, contents);
                }
                made
            })
            .collect();
        let cleared =
            program.buffers().iter().zip(&buffers).filter(|(b, _)| b.cleared).map(|(_, b)| b.clone());
        let both = wgpu::ShaderStages::COMPUTE | wgpu::ShaderStages::FRAGMENT;
        let textures = [bind::TEXTURE; 3].into_iter().take(1 + program.textures().layers.count());
        let frame_layout = layout(device, both, [bind::UNIFORM].into_iter().chain(textures));
        let own = |bindings: &[Binding], stages| {
            let layout = layout(device, stages, bindings.iter().map(|binding| bind::ty(*binding)));
            let resources = bindings.iter().map(|b| buffers[b.buffer()].as_entire_binding());
            let group = group(device, &layout, resources);
            (layout, group)
        };
        let modules: Vec<_> = program
            .shaders()
            .iter()
            .map(|source| {
                device.create_shader_module(wgpu::ShaderModuleDescriptor {
                    label: Some("aonet"),
                    source: wgpu::ShaderSource::Wgsl((**source).into()),
                })
            })
            .collect();
        let passes = program
            .passes()
            .iter()
            .map(|pass| {
                let (own, group) = own(&pass.bindings, wgpu::ShaderStages::COMPUTE);
                let groups = [Some(&frame_layout), Some(&own)];
                let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(&pass.label),
                    layout: Some(&pipeline_layout(device, &groups[usize::from(!pass.sees_frame)..])),
                    module: &modules[pass.shader],
                    entry_point: Some("main"),
                    compilation_options: Default::default(),
                    cache: None,
                });
                Pass { pipeline, group, sees_frame: pass.sees_frame, workgroups: pass.workgroups }
            })
            .collect();
        let (own, group) = own(&program.image().bindings, wgpu::ShaderStages::FRAGMENT);
        let module = &modules[program.image().shader];
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("aonet image"),
            layout: Some(&pipeline_layout(device, &[Some(&frame_layout), Some(&own)])),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some("cover"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some("main"),
                compilation_options: Default::default(),
                targets: &[Some(output.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let (cleared, device, queue) = (cleared.collect(), device.clone(), queue.clone());
        Self { device, queue, program, output, frame_layout, cleared, passes, image: (pipeline, group) }
    }

    /// Binds a frame's textures; once for each camera.
    ///
    /// # Errors
    /// When a texture has another size or format than the session needs.
    pub fn bind(&self, views: FrameViews<'_>) -> Result<BoundFrame> {
        let size = [self.program.size().width(), self.program.size().height()];
        let mut inputs = vec![("normal texture", views.normal), ("depth texture", views.depth)];
        if self.program.textures().layers == Layers::Two {
            let second = views.second.ok_or_else(|| Error::value("second depth texture", "one", "none"))?;
            inputs.push(("second depth texture", second));
        }
        let sides =
            |view: &wgpu::TextureView| [view.texture().width(), view.texture().height()].map(|n| n as usize);
        let shown = |[w, h]: [usize; 2]| format!("{w}x{h}");
        for (what, view) in &inputs {
            if sides(view) != size {
                return Err(Error::value(what, shown(size), shown(sides(view))));
            }
        }
        let found = sides(views.visibility);
        let rest = [0, 1].map(|i| size[i].checked_sub(found[i]).filter(|rest| rest % 2 == 0));
        let [Some(x), Some(y)] = rest else {
            let expected = format!("{}, or less by an even number of pixels", shown(size));
            return Err(Error::value("visibility texture", expected, shown(found)));
        };
        let format = views.visibility.texture().format();
        if format != self.output {
            return Err(Error::value(
                "visibility texture",
                format!("{:?}", self.output),
                format!("{format:?}"),
            ));
        }
        let bytes = aonet::gpu::program::FRAME_BYTES as u64;
        scoped(&self.device, "textures of a frame", || {
            let frame = empty(&self.device, "frame", bytes, wgpu::BufferUsages::UNIFORM);
            let textures = inputs.iter().map(|(_, view)| wgpu::BindingResource::TextureView(view));
            let group = group(
                &self.device,
                &self.frame_layout,
                [frame.as_entire_binding()].into_iter().chain(textures),
            );
            let margin = Margin { x: x / 2, y: y / 2 };
            BoundFrame { margin, frame, group, visibility: views.visibility.clone() }
        })
    }

    /// Encodes the passes of a frame, whose numbers are written when the encoder's commands are submitted next.
    ///
    /// # Errors
    /// When the camera has another size than the program, or the frame's numbers are out of range.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        bound: &BoundFrame,
        frame: &FrameNumbers,
    ) -> Result<()> {
        self.queue.write_buffer(&bound.frame, 0, &self.program.frame_bytes(bound.margin, frame)?);
        self.cleared.iter().for_each(|buffer| encoder.clear_buffer(buffer, 0, None));
        let mut compute = encoder.begin_compute_pass(&Default::default());
        for Pass { pipeline, group, sees_frame, workgroups: [x, y, z] } in &self.passes {
            compute.set_pipeline(pipeline);
            compute.set_bind_group(0, if *sees_frame { &bound.group } else { group }, &[]);
            if *sees_frame {
                compute.set_bind_group(1, group, &[]);
            }
            compute.dispatch_workgroups(*x, *y, *z);
        }
        drop(compute);
        let ops =
            wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::WHITE), store: wgpu::StoreOp::Store };
        let mut draw = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &bound.visibility,
                depth_slice: None,
                resolve_target: None,
                ops,
            })],
            ..Default::default()
        });
        draw.set_pipeline(&self.image.0);
        draw.set_bind_group(0, &bound.group, &[]);
        draw.set_bind_group(1, &self.image.1, &[]);
        draw.draw(0..3, 0..1);
        Ok(())
    }
}

/// The README's program compiles.
#[cfg(all(doctest, feature = "weights"))]
#[doc = include_str!("../README.md")]
struct Readme;
