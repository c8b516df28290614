//! Plain colours for scenes without colours, one for every part, so that parts are distinguishable.

use super::Scene;

/// Muted linear reflectances. guess: paint, wood, cloth and stone that leave the shading visible.
const PALETTE: [[f32; 3]; 8] = [
    [0.72, 0.69, 0.64],
    [0.55, 0.43, 0.31],
    [0.42, 0.50, 0.56],
    [0.66, 0.60, 0.46],
    [0.46, 0.53, 0.40],
    [0.61, 0.41, 0.36],
    [0.50, 0.50, 0.52],
    [0.74, 0.74, 0.76],
];

/// Gives every connected part of a scene without colours one of a few plain ones; the largest part gets the first, plaster. Parts are
/// connected by positions, not by vertices. A scene with colours does not change.
pub fn add_plain(scene: &mut Scene) {
    if !scene.albedo.is_empty() {
        return;
    }
    let mut part: Vec<u32> = first_at_place(scene);
    for t in &scene.triangle {
        let roots = t.map(|i| root(&mut part, i));
        let least = roots.into_iter().min().unwrap_or_default();
        roots.into_iter().for_each(|i| part[i as usize] = least);
    }
    let of: Vec<u32> = scene.triangle.iter().map(|t| root(&mut part, t[0])).collect();
    let mut area = vec![0f32; scene.position.len()];
    for (t, i) in scene.triangle.iter().zip(&of) {
        let [a, b, c] = t.map(|i| scene.position[i as usize]);
        area[*i as usize] += (b - a).cross(c - a).length();
    }
    let largest = (0..area.len()).max_by(|a, b| area[*a].total_cmp(&area[*b])).unwrap_or_default();
    scene.albedo = of.iter().map(|&i| colour(i, largest as u32)).collect();
}

fn colour(part: u32, largest: u32) -> [f32; 3] {
    if part == largest {
        return PALETTE[0];
    }
    // Fibonacci hashing, Knuth 1998 §6.4: neighbours in the mesh differ.
    let hash = part.wrapping_mul(0x9E37_79B9) >> 16;
    PALETTE[1 + hash as usize % (PALETTE.len() - 1)]
}

/// For each vertex the first vertex at the same place.
fn first_at_place(scene: &Scene) -> Vec<u32> {
    let mut first = std::collections::HashMap::with_capacity(scene.position.len());
    let key = |i: usize| scene.position[i].to_array().map(|c| (c + 0.0).to_bits());
    (0..scene.position.len()).map(|i| *first.entry(key(i)).or_insert(i as u32)).collect()
}

/// The representative vertex of a part; shortens the path to it.
fn root(part: &mut [u32], mut i: u32) -> u32 {
    while part[i as usize] != i {
        part[i as usize] = part[part[i as usize] as usize];
        i = part[i as usize];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// `n` triangles in a strip that touch in places only, `gap` apart from the next strip.
    fn strips(counts: &[usize]) -> Scene {
        let mut scene = Scene::default();
        for (row, &n) in counts.iter().enumerate() {
            for i in 0..n {
                let at = |dx: f32, dy: f32| Vec3::new(i as f32 + dx, 3.0 * row as f32 + dy, 0.0);
                let base = scene.position.len() as u32;
                scene.position.extend([at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)]);
                scene.triangle.push([base, base + 1, base + 2]);
            }
        }
        scene.normal = vec![Vec3::Z; scene.position.len()];
        scene
    }

    #[test]
    fn a_part_has_one_colour_and_the_largest_is_plaster() {
        let mut scene = strips(&[2, 5, 3]);
        add_plain(&mut scene);
        let same = |range: std::ops::Range<usize>| scene.albedo[range].windows(2).all(|w| w[0] == w[1]);
        assert!(same(0..2) && same(2..7) && same(7..10), "{:?}", scene.albedo);
        assert_eq!(scene.albedo[3], PALETTE[0]);
        assert_ne!(scene.albedo[0], PALETTE[0]);
        scene.checked().unwrap();
    }

    #[test]
    fn colours_that_are_there_stay() {
        let mut scene = strips(&[1, 1]);
        scene.albedo = vec![[0.1; 3]; 2];
        add_plain(&mut scene);
        assert_eq!(scene.albedo, [[0.1; 3]; 2]);
    }
}
