// Where the coarser levels of depth are, one after the other. Level 0 is the frame itself.

struct Levels {
    /// Cells before levels 1 to 4.
    first: vec4<u32>,
    /// Cells of a row of theirs.
    width: vec4<u32>,
}

/// Width and height of a level.
fn level_size(level: u32) -> vec2<u32> {
    return (frame.size + (1u << level) - 1u) >> vec2(level);
}
