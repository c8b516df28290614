//! WGSL to SPIR-V for Vulkan, as Godot's RenderingDevice takes it.

use crate::Error;
use naga::back::spv;
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::{Capabilities, ValidationFlags, Validator};

/// A stage of a shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// The entry point `main` of a dispatch.
    Compute,
    /// The entry point `cover` of a draw.
    Vertex,
    /// The entry point `main` of a draw.
    Fragment,
}

impl Stage {
    /// Its name in lists.
    pub fn name(self) -> &'static str {
        match self {
            Self::Compute => "compute",
            Self::Vertex => "vertex",
            Self::Fragment => "fragment",
        }
    }

    fn of_naga(self) -> naga::ShaderStage {
        match self {
            Self::Compute => naga::ShaderStage::Compute,
            Self::Vertex => naga::ShaderStage::Vertex,
            Self::Fragment => naga::ShaderStage::Fragment,
        }
    }
}

/// One stage of a WGSL source as a module of its own, whose entry point is `main`: Godot looks for that name.
///
/// # Errors
/// When the source is not valid or has no such stage.
pub fn compile(source: &str, stage: Stage) -> Result<Vec<u32>, Error> {
    let mut module = naga::front::wgsl::parse_str(source).map_err(|e| e.emit_to_string(source))?;
    module.entry_points.retain(|entry| entry.stage == stage.of_naga());
    let [entry] = &mut module.entry_points[..] else {
        return Err(format!(
            "shader: expected one {} stage, found {}",
            stage.name(),
            module.entry_points.len()
        )
        .into());
    };
    entry.name = "main".to_owned();
    let sees_frame =
        module.global_variables.iter().any(|(_, variable)| variable.space == naga::AddressSpace::Handle);
    let info = Validator::new(ValidationFlags::all(), Capabilities::all())
        .validate(&module)
        .map_err(|e| e.emit_to_string(source))?;
    // As in the crate's own sessions: what textures hold may be anything, all other indices come of the list.
    let index = if sees_frame { BoundsCheckPolicy::Restrict } else { BoundsCheckPolicy::Unchecked };
    let options = spv::Options {
        lang_version: (1, 3),
        bounds_check_policies: BoundsCheckPolicies {
            index,
            buffer: index,
            image_load: index,
            binding_array: BoundsCheckPolicy::Unchecked,
        },
        zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
        force_loop_bounding: false,
        emit_int_div_checks: false,
        flags: spv::WriterFlags::empty(),
        ..Default::default()
    };
    let main = spv::PipelineOptions { shader_stage: stage.of_naga(), entry_point: "main".to_owned() };
    Ok(spv::write_vec(&module, &info, &options, Some(&main))?)
}
