// Looks around every pixel. CPU twin: `Rows` of search/mod.rs.

/// Plane by plane.
@group(1) @binding(0) var<storage, read_write> found: array<f32>;

@compute @workgroup_size(TILE_WIDTH, TILE_HEIGHT)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= frame.size.x || id.y >= frame.size.y) {
        return;
    }
    let surface = surface_at(id.xy);
    var planes: array<f32, PLANES>;
    planes[0] = 1.0;
    if (surface.foreground) {
        planes = planes_at(pixel_of(id.xy, surface), noise_at(id.xy));
    }
    for (var c = 0u; c < PLANES; c++) {
        found[(c * frame.size.y + id.y) * frame.size.x + id.x] = planes[c];
    }
}
