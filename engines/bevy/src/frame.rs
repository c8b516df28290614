//! The numbers of a frame from Bevy's camera.

use aonet::frame::ClipDepth;
use aonet::gpu::FrameNumbers;
use aonet::{AoParams, Camera, Size};
use bevy::math::{Affine3A, Mat4, UVec2};

/// The numbers of a frame for a projection of Bevy's (reversed depth in [0, 1], the far plane at infinity with perspective),
/// a rigid transform of the camera and a radius (world units).
///
/// # Errors
/// When the camera's transform is not rigid, its projection is sheared, or the radius is not finite and above 0.
pub fn numbers(
    clip_from_view: Mat4,
    world_from_view: Affine3A,
    size: UVec2,
    radius: f32,
) -> aonet::Result<FrameNumbers> {
    let size = Size::new(size.x as usize, size.y as usize)?;
    let view_from_world = Mat4::from(world_from_view.inverse());
    let camera = Camera::from_clip_from_view(clip_from_view.to_cols_array_2d(), ClipDepth::ZeroToOne, size)?
        .with_view_from_world(view_from_world.to_cols_array_2d())?;
    Ok(FrameNumbers { camera, far: far(clip_from_view), params: AoParams::new(radius)? })
}

/// Distance of the far plane, where depth is 0 (world units).
fn far(clip_from_view: Mat4) -> f32 {
    match clip_from_view.z_axis.z {
        0.0 => f32::INFINITY,
        slope => clip_from_view.w_axis.z / slope,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::camera::{CameraProjection, OrthographicProjection, PerspectiveProjection};
    use bevy::math::{Quat, Vec3};

    const SIZE: UVec2 = UVec2::new(320, 180);

    #[test]
    fn planes_of_bevys_projections_are_found() {
        let perspective = PerspectiveProjection { near: 0.25, ..Default::default() }.get_clip_from_view();
        let found = numbers(perspective, Affine3A::IDENTITY, SIZE, 1.0).unwrap();
        assert_eq!((found.camera.near(), found.far), (0.25, f32::INFINITY));

        let mut parallel =
            OrthographicProjection { near: 0.5, far: 40.0, ..OrthographicProjection::default_3d() };
        parallel.update(320.0, 180.0);
        let found = numbers(parallel.get_clip_from_view(), Affine3A::IDENTITY, SIZE, 1.0).unwrap();
        assert!((found.camera.near() - 0.5).abs() < 1e-3 && (found.far - 40.0).abs() < 1e-2, "{found:?}");
    }

    #[test]
    fn scaled_cameras_and_senseless_radii_are_refused() {
        let perspective = PerspectiveProjection::default().get_clip_from_view();
        let scaled = Affine3A::from_scale_rotation_translation(Vec3::splat(2.0), Quat::IDENTITY, Vec3::ZERO);
        let error = numbers(perspective, scaled, SIZE, 1.0).unwrap_err().to_string();
        assert!(error.contains("rigid"), "{error}");
        for radius in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let error = numbers(perspective, Affine3A::IDENTITY, SIZE, radius).unwrap_err().to_string();
            assert!(error.contains("radius"), "{error}");
        }
    }
}
