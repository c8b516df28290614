// Computes the AO texture from the open rays of each pixel. CPU twin: the end of Disk::visibility in reference.rs.

struct Image {
    width: u32,
    /// Rays of each pixel so far.
    rays: u32,
}

@group(0) @binding(0) var<uniform> image: Image;
@group(0) @binding(1) var<storage, read> open: array<u32>;

@fragment
fn main(@builtin(position) place: vec4<f32>) -> @location(0) vec4<f32> {
    if (image.rays == 0u) {
        return vec4(1.0);
    }
    let pixel = vec2<u32>(place.xy);
    return vec4(f32(open[pixel.y * image.width + pixel.x]) / f32(image.rays));
}
