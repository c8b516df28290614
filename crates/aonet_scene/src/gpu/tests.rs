//! Validates every shader without a device.

use super::{image, reference, start};
use aonet::gpu::DepthEncoding;
use aonet::gpu::wgpu::{Limits, naga};

/// Panics if the shader is not valid WGSL or has more bindings of a kind than WebGPU guarantees.
fn validate(source: &str, what: &str) {
    let module = naga::front::wgsl::parse_str(source)
        .unwrap_or_else(|e| panic!("{what}: {}\n{source}", e.emit_to_string(source)));
    let capabilities = naga::valid::Capabilities::empty();
    let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities);
    validator.validate(&module).unwrap_or_else(|e| panic!("{what}: {}\n{source}", e.emit_to_string(source)));
    let storage = |space| matches!(space, naga::AddressSpace::Storage { .. });
    let buffers = module.global_variables.iter().filter(|(_, v)| storage(v.space)).count();
    let most = Limits::defaults().max_storage_buffers_per_shader_stage;
    assert!(buffers as u32 <= most, "{what}: {buffers} buffers");
}

#[test]
fn every_shader_is_valid() {
    validate(&reference::source(), "rays");
    validate(image::SOURCE, "image");
    for depth in [DepthEncoding::Linear, DepthEncoding::Reversed, DepthEncoding::Standard] {
        validate(&start::source(depth), &format!("start points of {depth:?}"));
    }
}

#[test]
#[should_panic(expected = "broken")]
fn a_broken_shader_is_noticed() {
    validate("fn main() -> u32 { return 1.5; }", "broken");
}
