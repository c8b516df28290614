//! Shaders, without a device.

use super::{present, shade};
use aonet::gpu::wgpu;
use wgpu::naga;

fn validate(source: &str, what: &str) {
    let module = naga::front::wgsl::parse_str(source)
        .unwrap_or_else(|e| panic!("{what}: {}\n{source}", e.emit_to_string(source)));
    let capabilities = naga::valid::Capabilities::empty();
    let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities);
    validator.validate(&module).unwrap_or_else(|e| panic!("{what}: {}\n{source}", e.emit_to_string(source)));
}

#[test]
fn every_shader_is_valid() {
    validate(include_str!("gbuffer.wgsl"), "gbuffer");
    validate(&shade::source(), "shade");
    for target_encodes in [false, true] {
        validate(&present::source(target_encodes), "present");
    }
}
