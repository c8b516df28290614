//! Buffers and pipelines of programs on a device. Programs that run beside one another share weights and compiled shaders.

use crate::error::{Error, Result};
use crate::gpu::options::{Kernels, Layers, Precision};
use crate::gpu::program::{Arithmetic, Binding, Buffer, Contents, Pass, Program, Usage};
use crate::gpu::wgpu_30::{bind, view};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// A device and what programs share on it.
#[derive(Debug)]
pub(crate) struct Host {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    /// Layout of the frame's group, group 0 of the shaders that see it.
    pub(crate) frame_layout: wgpu::BindGroupLayout,
    compiled: Mutex<HashMap<Shader, Arc<Compiled>>>,
    filled: Mutex<HashMap<Contents, wgpu::Buffer>>,
}

/// What a pipeline is compiled of.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Shader {
    source: Arc<str>,
    sees_frame: bool,
    bindings: Vec<wgpu::BindingType>,
    trusted: bool,
}

/// A compiled shader, and the layout of its own buffers.
#[derive(Debug)]
struct Compiled {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
}

/// A dispatch that can be encoded.
#[derive(Debug)]
pub(crate) struct Ready {
    pub(crate) label: String,
    compiled: Arc<Compiled>,
    group: wgpu::BindGroup,
    sees_frame: bool,
    workgroups: [u32; 3],
}

impl Host {
    /// `layers` are those of the frames that its programs see.
    pub(crate) fn new((device, queue): (&wgpu::Device, &wgpu::Queue), layers: Layers) -> Self {
        Self {
            frame_layout: view::layout(device, layers),
            device: device.clone(),
            queue: queue.clone(),
            compiled: Mutex::default(),
            filled: Mutex::default(),
        }
    }

    /// # Errors
    /// When the device was made without a feature that the shaders need.
    pub(crate) fn check_features(&self, arithmetic: Arithmetic) -> Result<()> {
        let has = |features| self.device.features().contains(features);
        let there = match arithmetic.kernels {
            Kernels::Plain => true,
            Kernels::Subgroups => has(wgpu::Features::SUBGROUP),
            Kernels::Matrices(_) => has(crate::gpu::Matrices::FEATURES),
        };
        if arithmetic.precision == Precision::F16 && !has(wgpu::Features::SHADER_F16) {
            return Err(Error::device("half floats", "the feature SHADER_F16", "none"));
        }
        match there {
            true => Ok(()),
            false => Err(Error::device(arithmetic.kernels.to_string(), "their features", "none")),
        }
    }

    /// The buffers of a program in order.
    ///
    /// # Errors
    /// When one is larger than a shader may see.
    pub(crate) fn buffers(&self, described: &[Buffer]) -> Result<Vec<wgpu::Buffer>> {
        described.iter().map(|buffer| self.buffer(buffer)).collect()
    }

    fn buffer(&self, described: &Buffer) -> Result<wgpu::Buffer> {
        match (&described.contents, described.usage) {
            (Some(contents), Usage::Storage) => self.shared(described, contents),
            (Some(contents), Usage::Uniform) => self.filled(described, contents),
            (None, _) => self.empty(described),
        }
    }

    /// A buffer with these contents, which programs only read: there is one for all that have the same contents.
    fn shared(&self, described: &Buffer, contents: &Contents) -> Result<wgpu::Buffer> {
        let mut all = self.filled.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = all.get(contents) {
            return Ok(found.clone());
        }
        let new = self.filled(described, contents)?;
        all.insert(Arc::clone(contents), new.clone());
        Ok(new)
    }

    fn filled(&self, described: &Buffer, contents: &[u8]) -> Result<wgpu::Buffer> {
        // Mapping a buffer where there is no memory for it would panic; writing to it is an error.
        let buffer = self.empty(described)?;
        self.queue.write_buffer(&buffer, 0, contents);
        Ok(buffer)
    }

    fn empty(&self, described: &Buffer) -> Result<wgpu::Buffer> {
        let usage = match described.usage {
            Usage::Uniform => wgpu::BufferUsages::UNIFORM,
            Usage::Storage => wgpu::BufferUsages::STORAGE,
        };
        bind::checked_buffer(&self.device, &described.label, described.bytes, usage)
    }

    /// The dispatches of a program, with its buffers.
    pub(crate) fn passes(&self, program: &Program, buffers: &[wgpu::Buffer]) -> Vec<Ready> {
        let shaders = program.shaders();
        program.passes().iter().map(|p| self.pass(p, &shaders[p.shader], buffers, program.trusted)).collect()
    }

    /// One dispatch.
    pub(crate) fn pass(
        &self,
        pass: &Pass,
        source: &Arc<str>,
        buffers: &[wgpu::Buffer],
        trusted: bool,
    ) -> Ready {
        let shader = Shader {
            source: Arc::clone(source),
            sees_frame: pass.sees_frame,
            bindings: pass.bindings.iter().map(|binding| ty(*binding)).collect(),
            trusted,
        };
        let compiled = self.compile(shader, &pass.label);
        let resources = bound(&pass.bindings, buffers);
        let group = bind::group(&self.device, &pass.label, &compiled.layout, resources);
        let (label, sees_frame, workgroups) = (pass.label.clone(), pass.sees_frame, pass.workgroups);
        Ready { label, compiled, group, sees_frame, workgroups }
    }

    fn compile(&self, shader: Shader, label: &str) -> Arc<Compiled> {
        let mut all = self.compiled.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = all.get(&shader) {
            return Arc::clone(found);
        }
        let module = module(&self.device, label, &shader);
        let layout = bind::layout(&self.device, label, wgpu::ShaderStages::COMPUTE, &shader.bindings);
        let groups = [&self.frame_layout, &layout];
        let groups = if shader.sees_frame { &groups[..] } else { &groups[1..] };
        let pipeline_layout = bind::pipeline_layout(&self.device, label, groups);
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(label),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions {
                // In shaders of this crate, every invocation reads what one of its workgroup wrote.
                zero_initialize_workgroup_memory: !shader.trusted,
                ..Default::default()
            },
            cache: None,
        });
        let new = Arc::new(Compiled { pipeline, layout });
        all.insert(shader, Arc::clone(&new));
        new
    }
}

/// The module of a shader. Those of this crate go without the checks that they have no need of: counters that end every loop
/// keep drivers from unrolling them, and indices that are cut off at an array's length have to be computed one by one. See
/// PERFORMANCE.md.
#[allow(unsafe_code, reason = "checks that hold anyway take more instructions than a convolution")]
fn module(device: &wgpu::Device, label: &str, shader: &Shader) -> wgpu::ShaderModule {
    if !shader.trusted {
        return bind::module(device, label, &shader.source);
    }
    let descriptor = wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl((*shader.source).into()),
    };
    let checks = wgpu::ShaderRuntimeChecks {
        // What textures hold may be anything.
        bounds_checks: shader.sees_frame,
        force_loop_bounding: false,
        int_div_checks: false,
        ..wgpu::ShaderRuntimeChecks::checked()
    };
    // SAFETY: only this crate builds trusted programs, and nothing outside it can change one. Loops run as often as constants
    // and a plan's numbers of blocks say, and no divisor is 0. Without textures, indices come of a plan and of the places of
    // invocations, which are held within the buffers that were made for that plan; weights were checked against the graph
    // when the model was loaded.
    unsafe { device.create_shader_module_trusted(descriptor, checks) }
}

/// How a shader sees a buffer.
pub(crate) fn ty(binding: Binding) -> wgpu::BindingType {
    match binding {
        Binding::Uniform(_) => bind::UNIFORM,
        Binding::Read(_) => bind::READ,
        Binding::Write(_) => bind::WRITE,
    }
}

/// The buffers that are bound.
pub(crate) fn bound<'a>(
    bindings: &'a [Binding],
    buffers: &'a [wgpu::Buffer],
) -> impl Iterator<Item = wgpu::BindingResource<'a>> {
    bindings.iter().map(|binding| buffers[binding.buffer()].as_entire_binding())
}

impl Ready {
    /// Encodes a dispatch that sees no frame.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn encode_alone(&self, pass: &mut wgpu::ComputePass<'_>) {
        self.dispatch(pass, None);
    }

    /// Encodes the dispatch; `frame` is the frame's group.
    pub(crate) fn encode(&self, pass: &mut wgpu::ComputePass<'_>, frame: &wgpu::BindGroup) {
        self.dispatch(pass, Some(frame).filter(|_| self.sees_frame));
    }

    fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, frame: Option<&wgpu::BindGroup>) {
        pass.set_pipeline(&self.compiled.pipeline);
        if let Some(frame) = frame {
            pass.set_bind_group(0, frame, &[]);
        }
        pass.set_bind_group(u32::from(self.sees_frame), &self.group, &[]);
        let [x, y, z] = self.workgroups;
        pass.dispatch_workgroups(x, y, z);
    }
}
