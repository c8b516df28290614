//! One dispatch: a pipeline, what it reads and writes, and how many workgroups.

use crate::gpu::shader::Shader;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// A buffer and how a shader sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Binding<'a> {
    Uniform(&'a wgpu::Buffer),
    Read(&'a wgpu::Buffer),
    Write(&'a wgpu::Buffer),
}

impl<'a> Binding<'a> {
    fn buffer(self) -> &'a wgpu::Buffer {
        match self {
            Self::Uniform(buffer) | Self::Read(buffer) | Self::Write(buffer) => buffer,
        }
    }

    fn ty(self) -> wgpu::BufferBindingType {
        match self {
            Self::Uniform(_) => wgpu::BufferBindingType::Uniform,
            Self::Read(_) => wgpu::BufferBindingType::Storage { read_only: true },
            Self::Write(_) => wgpu::BufferBindingType::Storage { read_only: false },
        }
    }
}

/// The layout of a group of buffers.
pub(crate) fn layout(
    device: &wgpu::Device,
    label: &str,
    stage: wgpu::ShaderStages,
    bindings: &[Binding<'_>],
) -> wgpu::BindGroupLayout {
    let entry = |(binding, of): (usize, &Binding<'_>)| wgpu::BindGroupLayoutEntry {
        binding: binding as u32,
        visibility: stage,
        ty: wgpu::BindingType::Buffer { ty: of.ty(), has_dynamic_offset: false, min_binding_size: None },
        count: None,
    };
    let entries: Vec<_> = bindings.iter().enumerate().map(entry).collect();
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// A group of buffers.
pub(crate) fn group(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    bindings: &[Binding<'_>],
) -> wgpu::BindGroup {
    let resources = bindings.iter().map(|of| of.buffer().as_entire_binding());
    let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
    let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

/// What a shader is compiled to, and the layout of its own buffers.
#[derive(Debug)]
pub(crate) struct Compiled {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
}

/// Compiled shaders by their source: sessions of one network share them.
#[derive(Debug)]
pub(crate) struct Compiler {
    pub(crate) device: wgpu::Device,
    /// Layout of the textures of a frame, group 0 of the shaders that see them.
    pub(crate) view_layout: wgpu::BindGroupLayout,
    compiled: Mutex<HashMap<String, Arc<Compiled>>>,
}

impl Compiler {
    pub(crate) fn new(device: &wgpu::Device, view_layout: wgpu::BindGroupLayout) -> Self {
        Self { device: device.clone(), view_layout, compiled: Mutex::default() }
    }

    fn compile(&self, recipe: &Recipe<'_>, bindings: &[Binding<'_>]) -> Arc<Compiled> {
        let source = recipe.shader.source();
        let mut compiled = self.compiled.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = compiled.get(source) {
            return Arc::clone(found);
        }
        let label = Some(recipe.label);
        let module = module(&self.device, recipe);
        let layout = layout(&self.device, recipe.label, wgpu::ShaderStages::COMPUTE, bindings);
        let groups = [Some(&self.view_layout), Some(&layout)];
        let pipeline_layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label,
            bind_group_layouts: if recipe.sees_frame { &groups } else { &groups[1..] },
            immediate_size: 0,
        });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label,
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions {
                // Every invocation reads what one of its workgroup wrote.
                zero_initialize_workgroup_memory: false,
                ..Default::default()
            },
            cache: None,
        });
        let new = Arc::new(Compiled { pipeline, layout });
        compiled.insert(source.to_owned(), Arc::clone(&new));
        new
    }
}

/// The module of a shader without the checks that it has no need of: counters that end every loop keep drivers from unrolling
/// them, and indices that are cut off at an array's length have to be computed one by one. See PERFORMANCE.md.
#[allow(unsafe_code, reason = "checks that hold anyway take more instructions than a convolution")]
fn module(device: &wgpu::Device, recipe: &Recipe<'_>) -> wgpu::ShaderModule {
    let descriptor = wgpu::ShaderModuleDescriptor {
        label: Some(recipe.label),
        source: wgpu::ShaderSource::Wgsl(recipe.shader.source().into()),
    };
    let checks = wgpu::ShaderRuntimeChecks {
        // What textures hold may be anything.
        bounds_checks: recipe.sees_frame,
        force_loop_bounding: false,
        int_div_checks: false,
        ..wgpu::ShaderRuntimeChecks::checked()
    };
    // SAFETY: the shaders are those of this crate. Loops run as often as constants and a plan's numbers of blocks say, and no
    // divisor is 0. Without textures, indices come of a plan and of the places of invocations, which are held within the
    // buffers that were made for that plan; weights were checked against the graph when the model was loaded.
    unsafe { device.create_shader_module_trusted(descriptor, checks) }
}

/// A shader under a name.
#[derive(Debug)]
pub(crate) struct Recipe<'a> {
    pub(crate) label: &'a str,
    pub(crate) shader: Shader,
    /// Whether it reads the textures of a frame.
    pub(crate) sees_frame: bool,
}

/// A dispatch, ready to be encoded.
#[derive(Debug)]
pub(crate) struct Pass {
    pub(crate) label: String,
    compiled: Arc<Compiled>,
    group: wgpu::BindGroup,
    sees_frame: bool,
    workgroups: [u32; 3],
}

impl Pass {
    pub(crate) fn new(
        compiler: &Compiler,
        recipe: &Recipe<'_>,
        bindings: &[Binding<'_>],
        workgroups: [usize; 3],
    ) -> Self {
        let compiled = compiler.compile(recipe, bindings);
        let group = group(&compiler.device, recipe.label, &compiled.layout, bindings);
        Self {
            label: recipe.label.to_owned(),
            compiled,
            group,
            sees_frame: recipe.sees_frame,
            workgroups: workgroups.map(|n| n as u32),
        }
    }

    /// Encodes a dispatch that sees no frame.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn encode_alone(&self, pass: &mut wgpu::ComputePass<'_>) {
        self.dispatch(pass, None);
    }

    pub(crate) fn encode(&self, pass: &mut wgpu::ComputePass<'_>, view: &wgpu::BindGroup) {
        self.dispatch(pass, Some(view).filter(|_| self.sees_frame));
    }

    fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, view: Option<&wgpu::BindGroup>) {
        pass.set_pipeline(&self.compiled.pipeline);
        if let Some(view) = view {
            pass.set_bind_group(0, view, &[]);
        }
        pass.set_bind_group(u32::from(self.sees_frame), &self.group, &[]);
        let [x, y, z] = self.workgroups;
        pass.dispatch_workgroups(x, y, z);
    }
}
