// Rays through the hierarchy that trace/flat.rs lays out. CPU twin: trace/traverse.rs.

@group(0) @binding(1) var<storage, read> nodes: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> triangles: array<vec4<f32>>;

/// Words of four a node: bounds, then children.
const NODE: u32 = 14u;
const CHILDREN: u32 = 12u;
/// See LEAF of trace/build.rs.
const LEAF: u32 = 0x80000000u;
/// Relative error of the box test. Division is right to 2.5 units in the last place, subtraction and product to half a unit:
/// 3.5 on both sides of a comparison, and as much again.
const BOX_ERROR: f32 = 14.0 * 1.1920929e-7;
/// Smallest component of a direction, so that its inverse is finite.
const LEAST: f32 = 1e-30;

/// World space.
struct Ray {
    origin: vec3<f32>,
    direction: vec3<f32>,
    /// In lengths of its direction.
    length: f32,
}

// Fused where the hardware can, and in the order of the twin: then both find the same hits.
fn dot_fused(a: vec3<f32>, b: vec3<f32>) -> f32 {
    return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z));
}

fn cross_fused(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return fma(a.yzx, b.zxy, -(a.zxy * b.yzx));
}

/// Result of a ray that meets no triangle.
const NOTHING: u32 = 0xffffffffu;

/// Whether the ray meets a triangle at 0 < t <= its length.
// Möller and Trumbore 1997, scaled by the determinant: no division.
fn hits(triangle: u32, ray: Ray) -> bool {
    let v0 = triangles[3u * triangle];
    let e1 = triangles[3u * triangle + 1u];
    let e2 = triangles[3u * triangle + 2u];
    let normal = vec3(v0.w, e1.w, e2.w);
    let c = v0.xyz - ray.origin;
    let r = cross_fused(ray.direction, c);
    let det = dot_fused(normal, ray.direction);
    let side = select(1.0, -1.0, det < 0.0);
    let u = side * dot_fused(r, e2.xyz);
    let v = side * dot_fused(r, e1.xyz);
    let t = side * dot_fused(normal, c);
    return 0.0 <= u && 0.0 <= v && u + v <= abs(det) && 0.0 < t && t <= ray.length * abs(det);
}

fn row(node: u32, index: u32, half: u32) -> vec4<f32> {
    return bitcast<vec4<f32>>(nodes[node * NODE + 2u * index + half]);
}

/// A node, 8 bits up, and which of its children the ray meets.
fn meets(node: u32, ray: Ray, inverse: vec3<f32>) -> u32 {
    let behind = vec3<u32>(inverse < vec3(0.0));
    var met = 0u;
    for (var half = 0u; half < 2u; half++) {
        var enter = vec4(0.0);
        var leave = vec4(ray.length);
        for (var axis = 0u; axis < 3u; axis++) {
            let near = row(node, 2u * axis + behind[axis], half) - ray.origin[axis];
            let far = row(node, 2u * axis + 1u - behind[axis], half) - ray.origin[axis];
            enter = max(enter, near * inverse[axis]);
            leave = min(leave, far * inverse[axis] * (1.0 + BOX_ERROR));
        }
        let bits = select(vec4(0u), vec4(1u, 2u, 4u, 8u), enter <= leave);
        met |= (bits.x | bits.y | bits.z | bits.w) << (4u * half);
    }
    return (node << 8u) | met;
}

/// Into the back, of no particular length.
fn back_normal(triangle: u32) -> vec3<f32> {
    return vec3(triangles[3u * triangle].w, triangles[3u * triangle + 1u].w, triangles[3u * triangle + 2u].w);
}

/// Whether a ray along a unit vector hits the front of a triangle at more than 81 degrees.
// guess: the error of 8-bit normals is smaller.
fn head_on(triangle: u32, ray: Ray) -> bool {
    let normal = back_normal(triangle);
    return dot(normal, ray.direction) > 0.99 * length(normal);
}

/// Where the ray meets a triangle's plane, in lengths of its direction.
fn distance_to(triangle: u32, ray: Ray) -> f32 {
    let normal = back_normal(triangle);
    return dot(normal, triangles[3u * triangle].xyz - ray.origin) / dot(normal, ray.direction);
}

/// Any triangle that a ray meets, or the first that it hits head-on; NOTHING if there is none.
fn met(along: Ray, any: bool) -> u32 {
    var ray = along;
    var first = NOTHING;
    let size = max(abs(ray.direction), vec3(LEAST));
    let inverse = 1.0 / select(size, -size, ray.direction < vec3(0.0));
    var stack: array<u32, MAX_DEPTH>;
    var top = 0u;
    var group = meets(0u, ray, inverse);
    loop {
        if ((group & 255u) == 0u) {
            if (top == 0u) {
                break;
            }
            top -= 1u;
            group = stack[top];
        }
        let node = group >> 8u;
        let k = firstTrailingBit(group);
        group &= group - 1u;
        let word = nodes[node * NODE + CHILDREN + (k >> 2u)][k & 3u];
        if ((word & LEAF) == 0u) {
            if ((group & 255u) != 0u) {
                stack[top] = group;
                top += 1u;
            }
            group = meets(word, ray, inverse);
            continue;
        }
        let begin = word & 0xfffffffu;
        let last = begin + ((word >> 28u) & 7u);
        for (var triangle = begin; triangle <= last; triangle++) {
            if (hits(triangle, ray) && (any || head_on(triangle, ray))) {
                if (any) {
                    return triangle;
                }
                first = triangle;
                ray.length = distance_to(triangle, ray);
            }
        }
    }
    return first;
}

/// Whether the ray meets any triangle.
fn blocked(ray: Ray) -> bool {
    return met(ray, true) != NOTHING;
}
