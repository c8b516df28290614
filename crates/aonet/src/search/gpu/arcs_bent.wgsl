// Connected arcs of every pixel with bent normals. CPU twin: `lost_beam` and `planes` of search/arcs.rs.

/// The vector of the light that a side loses, towards the viewer and along: what is lost in each of its parts has the mean direction of the
/// part's light.
fn lost_beam(s: Slice, side: Side, found: array<u32, SHARES>) -> vec2<f32> {
    let tangent = clamp(-s.sin_n * side.sign, -1.0, 1.0);
    var lost = vec2(0.0);
    var begin = 0.0;
    var above = vec2(0.0);
    for (var i = 0u; i < PART_COUNT; i++) {
        let beam = beam_above(s, (tangent - 1.0) * PARTS[i] + 1.0, side.sign);
        let below = round(clamp(beam.x * side.scale + side.dither, 0.0, SECTORS));
        let end = select(below, SECTORS, i + 1u == PART_COUNT);
        let bits = sectors(u32(begin), u32(end));
        var count = 0.0;
        for (var c = 0u; c < SHARES; c++) {
            count += f32(countOneBits(found[c] & bits)) * LOST[c];
        }
        lost += (beam.yz - above) * (count / max(end - begin, 1.0));
        begin = end;
        above = beam.yz;
    }
    return lost;
}

/// The visibility, the shares of light, and the bend.
fn planes_at(p: Pixel, noise: vec2<f32>) -> array<f32, PLANES> {
    var light: Light;
    var bent = vec3(0.0);
    // For the vector of the open sky.
    var leaning = vec3(0.0);
    for (var i = 0u; i < SLICES; i++) {
        let s = numbered(p, noise, i);
        for (var sign = 1.0; sign >= -1.0; sign -= 2.0) {
            let side = side_in(p, s, noise, i, sign);
            let found = found_on(p, s, side, noise, i);
            add_light(&light, light_on(s, side, found));
            let lost = s.normal_length * lost_beam(s, side, found);
            bent += lost.x * p.to_viewer + lost.y * s.along;
        }
        leaning += s.normal_length * s.sin_n * s.along;
    }
    var planes = planes_of(light);
    let bend = bend_of(p, bent, leaning, visible_share(light), planes[0]);
    planes[SHARES + 1u] = bend.x;
    planes[SHARES + 2u] = bend.y;
    planes[SHARES + 3u] = bend.z;
    return planes;
}
