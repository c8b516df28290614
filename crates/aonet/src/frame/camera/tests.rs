use super::*;

const SIZE: Size = Size::px(640, 360);

fn camera(projection: Projection) -> Camera {
    let camera = Camera::new(projection, SIZE).unwrap().with_near(0.1).unwrap();
    camera.looking_at([1.0, 2.0, 3.0], [0.0; 3], Vec3::Y).unwrap()
}

#[test]
fn target_is_on_the_axis_at_its_distance() {
    let c = camera(Projection::Perspective { fov_y: 1.0 });
    let p = c.view_from_world().transform_point3(Vec3::ZERO);
    assert!(p.truncate().length() < 1e-5 && (p.z + 14f32.sqrt()).abs() < 1e-5, "{p}");
}

#[test]
fn corner_pixels_span_the_field_of_view() {
    let c = camera(Projection::Perspective { fov_y: 1.0 });
    let top = c.position_view(320, 0, 1.0);
    assert!((top.y - (0.5f32).tan() * (1.0 - 1.0 / 360.0)).abs() < 1e-5);
    let o = camera(Projection::Orthographic { height: 2.0 });
    assert!((o.position_view(320, 359, 5.0).y + 1.0 - 1.0 / 360.0).abs() < 1e-5);
}

#[test]
fn bad_cameras_are_refused() {
    let centred = Camera::perspective(1.0, Size::px(8, 8)).unwrap();
    assert!(centred.looking_at(Vec3::ZERO, Vec3::ZERO, Vec3::Y).is_err());
    assert!(centred.looking_at(Vec3::ZERO, Vec3::Y, Vec3::Y).is_err());
    assert!(centred.looking_at(Vec3::ZERO, Vec3::NAN, Vec3::Y).is_err());
    assert!(Camera::perspective(0.0, SIZE).is_err() && Camera::perspective(4.0, SIZE).is_err());
    assert!(Camera::orthographic(f32::NAN, SIZE).is_err());
    assert!(centred.with_near(-1.0).is_err() && centred.with_near(f32::INFINITY).is_err());
    assert!(centred.with_centre_px([f32::NAN, 0.0]).is_err() && centred.with_focal_px([1.0, 0.0]).is_err());
    let scaled = Mat4::from_scale(Vec3::splat(2.0)).to_cols_array_2d();
    let mirrored = Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0)).to_cols_array_2d();
    assert!(centred.with_view_from_world(scaled).is_err() && centred.with_view_from_world(mirrored).is_err());
}

/// A projection matrix with the planes x = left..right, y = bottom..top at distance 1 (perspective) or anywhere, and
/// a third row of `slope` and `offset`. Columns of a right-handed view space.
fn matrix(is_perspective: bool, [left, right, bottom, top]: [f32; 4], [slope, offset]: [f32; 2]) -> Mat4 {
    let (width, height) = (right - left, top - bottom);
    let middle = [(right + left) / width, (top + bottom) / height];
    let columns = match is_perspective {
        true => [[middle[0], middle[1], slope, -1.0], [0.0, 0.0, offset, 0.0]],
        false => [[0.0, 0.0, slope, 0.0], [-middle[0], -middle[1], offset, 1.0]],
    };
    let scales = [[2.0 / width, 0.0, 0.0, 0.0], [0.0, 2.0 / height, 0.0, 0.0]];
    Mat4::from_cols_array_2d(&[scales[0], scales[1], columns[0], columns[1]])
}

/// Every depth convention gives the constructor's camera and its near plane.
#[test]
fn projection_matrices_are_read() {
    let (near, far) = (0.25, 50.0);
    let tan = 0.5f32.tan();
    let aspect = 640.0 / 360.0;
    let range = far - near;
    let (to_one, both) = (ClipDepth::ZeroToOne, ClipDepth::MinusOneToOne);
    let expected = Camera::perspective(1.0, SIZE).unwrap().with_near(near).unwrap();
    for (row, depth) in [
        ([-far / range, -near * far / range], to_one),
        ([near / range, near * far / range], to_one),
        ([-1.0, -near], to_one),
        ([0.0, near], to_one),
        ([-(far + near) / range, -2.0 * near * far / range], both),
        ([-1.0, -2.0 * near], both),
    ] {
        let m = matrix(true, [-tan * aspect, tan * aspect, -tan, tan], row);
        near_equal(&Camera::from_clip_from_view(m.to_cols_array_2d(), depth, SIZE).unwrap(), &expected);
        let y_down = Mat4::from_scale(Vec3::new(1.0, -1.0, 1.0)) * m;
        near_equal(&Camera::from_clip_from_view(y_down.to_cols_array_2d(), depth, SIZE).unwrap(), &expected);
    }
    let expected = Camera::orthographic(2.0, SIZE).unwrap().with_near(near).unwrap();
    for (row, depth) in [
        ([-1.0 / range, -near / range], to_one),
        ([1.0 / range, far / range], to_one),
        ([-2.0 / range, -(far + near) / range], both),
    ] {
        let m = matrix(false, [-aspect, aspect, -1.0, 1.0], row);
        near_equal(&Camera::from_clip_from_view(m.to_cols_array_2d(), depth, SIZE).unwrap(), &expected);
    }
}

fn near_equal(found: &Camera, expected: &Camera) {
    let numbers = |c: &Camera| [c.focal_px(), c.centre_px(), [c.near(), c.near()]];
    assert_eq!((found.size(), found.is_perspective()), (expected.size(), expected.is_perspective()));
    for (a, b) in numbers(found).as_flattened().iter().zip(numbers(expected).as_flattened()) {
        assert!((a - b).abs() <= 1e-4 * b.abs(), "{found:?} {expected:?}");
    }
}

#[test]
fn other_matrices_are_refused() {
    let m = matrix(true, [-1.0, 1.0, -1.0, 1.0], [0.0, 0.1]);
    let read = |m: Mat4| Camera::from_clip_from_view(m.to_cols_array_2d(), ClipDepth::ZeroToOne, SIZE);
    assert!(read(m).is_ok());
    let left_handed = m * Mat4::from_scale(Vec3::new(1.0, 1.0, -1.0));
    let message = read(left_handed).unwrap_err().to_string();
    assert!(message.contains("negate the third column"), "{message}");
    for wrong in [Mat4::NAN, m * Mat4::from_rotation_z(0.3), m * Mat4::from_translation(Vec3::X)] {
        assert!(read(wrong).is_err(), "{wrong}");
    }
}

/// A point that an off-centre matrix projects to a pixel is the position of that pixel.
#[test]
fn positions_agree_with_an_off_centre_matrix() {
    let frustum = matrix(true, [-0.6, 1.4, -0.4, 1.0], [0.0, 0.5]);
    let flat = matrix(false, [-3.0, 8.0, -2.0, 5.0], [0.03, 1.03]);
    for m in [frustum, flat] {
        let camera = Camera::from_clip_from_view(m.to_cols_array_2d(), ClipDepth::ZeroToOne, SIZE).unwrap();
        for (x, y, depth) in [(0, 0, 1.0), (639, 359, 7.0), (100, 300, 2.5)] {
            let p: Vec3 = camera.position_view(x, y, depth).into();
            let ndc = m.project_point3(p);
            let px = [0.5 * (1.0 + ndc.x) * 640.0, 0.5 * (1.0 - ndc.y) * 360.0];
            assert!((px[0] - x as f32 - 0.5).abs() < 1e-3 && (px[1] - y as f32 - 0.5).abs() < 1e-3, "{px:?}");
            assert_eq!(p.z, -depth);
        }
    }
}

#[test]
fn tiles_and_margins_see_what_the_picture_sees() {
    let whole = camera(Projection::Perspective { fov_y: 1.0 });
    let tile = whole.tile(64, 32, Size::px(128, 96)).unwrap();
    assert_eq!(tile.position_view(3, 5, 2.0), whole.position_view(67, 37, 2.0));
    let guarded = whole.with_margin(Margin { x: 64, y: 36 }).unwrap();
    assert_eq!(guarded.size(), Size::px(768, 432));
    assert_eq!(guarded.position_view(64, 36, 2.0), whole.position_view(0, 0, 2.0));
}
