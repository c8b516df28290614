//! Neighbours of a pixel. A network may add a part of what the search found there more than at the pixel: kernel prediction
//! (Bako et al. 2017) over differences.

/// Most distances at which a network has neighbours.
pub const MAX_DISTANCES: usize = 4;

/// The farthest neighbours (px).
pub const MAX_DISTANCE: usize = 8;

/// Neighbours at one distance.
const RING: usize = 8;

/// What an output of the network weighs: little, because those of all neighbours add up.
pub const UNIT: f32 = 0.05;

/// Number of neighbours.
pub fn count(distances: &[usize]) -> usize {
    RING * distances.len()
}

/// Rows and columns from a pixel to its neighbours: for every distance the corners and the middles of the sides of a square, row by row.
pub fn offsets(distances: &[usize]) -> Vec<[isize; 2]> {
    let ring = |distance: &usize| {
        let d = *distance as isize;
        [[-d, -d], [-d, 0], [-d, d], [0, -d], [0, d], [d, -d], [d, 0], [d, d]]
    };
    distances.iter().flat_map(ring).collect()
}
