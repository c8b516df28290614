//! Decides by the G-buffer whether a view is good enough for a dataset.

use crate::gbuffer::Surface;
use aonet::GBuffer;
use glam::Vec3A;

/// Why a view is not kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Flaw {
    /// No camera was found: nothing to stand on, or nothing of the scene in sight.
    Nowhere,
    /// Mostly background or bare ground.
    Empty,
    /// The camera is inside something solid: it sees backs.
    Inside,
    /// Something fills the image from very near.
    Blocked,
    /// A bare wall: neither depth nor normals change.
    Bare,
}

impl Flaw {
    /// All flaws, in the order of the checks.
    pub const ALL: [Self; 5] = [Self::Nowhere, Self::Empty, Self::Inside, Self::Blocked, Self::Bare];

    /// A short description for reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nowhere => "no place for a camera",
            Self::Empty => "mostly background or ground",
            Self::Inside => "inside something",
            Self::Blocked => "a wall in the face",
            Self::Bare => "nothing to see",
        }
    }
}

/// Criteria for a view. guess: chosen by eye on contact sheets of 101 scenes.
#[derive(Debug, Clone, Copy)]
pub(super) struct ViewCriteria {
    /// Largest share of background pixels.
    pub background: f32,
    /// Smallest share of pixels that show the scene itself, not its ground.
    pub content: f32,
    /// Largest share of foreground pixels that show the back of their triangle.
    pub backface: f32,
    /// Smallest median depth, in radii of the scene.
    pub median_depth: f32,
    /// Depth below which a pixel is near, in median depths.
    pub near: f32,
    /// Largest share of near pixels.
    pub near_share: f32,
    /// Smallest share of foreground pixels at an edge of depth or normal, in an image 96 pixels wide.
    pub edges: f32,
}

/// Facts about the scene that the checks need.
#[derive(Debug, Clone, Copy)]
pub(super) struct Subject {
    /// Radius of the scene's bounding sphere, without the ground (world units).
    pub radius: f32,
    /// Triangles from this one on are ground.
    pub ground_from: u32,
}

/// Checks a small view; returns the median depth of its foreground (world units).
pub(super) fn judge(surface: &Surface, subject: Subject, criteria: &ViewCriteria) -> Result<f32, Flaw> {
    let gbuffer = &surface.gbuffer;
    let mut depth: Vec<f32> = gbuffer.depth().iter().copied().filter(|d| d.is_finite()).collect();
    let pixels = gbuffer.depth().len() as f32;
    let foreground = depth.len() as f32;
    let content = surface.triangle.iter().filter(|&&t| t < subject.ground_from).count() as f32;
    if pixels - foreground > criteria.background * pixels || content < criteria.content * pixels {
        return Err(Flaw::Empty);
    }
    let backs = surface.backface.iter().filter(|&&b| b).count() as f32;
    if backs > criteria.backface * foreground {
        return Err(Flaw::Inside);
    }
    depth.sort_unstable_by(f32::total_cmp);
    let median = depth[depth.len() / 2];
    let near = depth.partition_point(|&d| d < criteria.near * median) as f32;
    if median < criteria.median_depth * subject.radius || near > criteria.near_share * pixels {
        return Err(Flaw::Blocked);
    }
    if edges(gbuffer) < criteria.edges * foreground {
        return Err(Flaw::Bare);
    }
    Ok(median)
}

/// Number of foreground pixels whose right or lower neighbour is another surface: it lies off the pixel's
/// tangent plane by a fiftieth of the depth, or its normal turns by 25 degrees. The background does not count.
fn edges(gbuffer: &GBuffer) -> f32 {
    let (width, height) = (gbuffer.width(), gbuffer.height());
    let position = |i: usize| gbuffer.camera().position_view(i % width, i / width, gbuffer.depth()[i]);
    let normal = |i: usize| Vec3A::from(gbuffer.normal()[i]);
    let differs = |a: usize, b: usize| {
        let step = normal(a).dot(position(b) - position(a)).abs();
        gbuffer.is_foreground(b) && (step > 0.02 * gbuffer.depth()[a] || normal(a).dot(normal(b)) < 0.9)
    };
    let edge = |i: usize| {
        let (x, y) = (i % width, i / width);
        (x + 1 < width && differs(i, i + 1)) || (y + 1 < height && differs(i, i + width))
    };
    (0..width * height).filter(|&i| gbuffer.is_foreground(i) && edge(i)).count() as f32
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{cuboid, room};
    use super::*;
    use crate::gbuffer::render;
    use crate::trace::Tracer;
    use crate::{Scene, View};
    use glam::Vec3;

    const CRITERIA: ViewCriteria = ViewCriteria {
        background: 0.5,
        content: 0.1,
        backface: 0.3,
        median_depth: 0.08,
        near: 0.2,
        near_share: 0.25,
        edges: 0.08,
    };

    fn verdict(scene: &Scene, eye: Vec3, target: Vec3) -> Result<f32, Flaw> {
        let view = View {
            eye: eye.into(),
            target: target.into(),
            up: [0.0, 1.0, 0.0],
            fov_y_deg: 60.0,
            ortho_height: None,
            width: 96,
            height: 54,
            near: 1e-3,
            far: f32::INFINITY,
            radius: 1.0,
            margin: 0.0,
            separation: None,
        };
        let subject = Subject { radius: scene.bounds().radius(), ground_from: u32::MAX };
        judge(&render(&Tracer::new(scene.clone()), &view).unwrap(), subject, &CRITERIA)
    }

    #[test]
    fn a_room_is_kept_with_its_depth() {
        let median = verdict(&room(), Vec3::new(-2.8, 2.0, 2.3), Vec3::new(1.0, 0.5, -1.0)).unwrap();
        assert!((2.0..5.0).contains(&median), "{median}");
    }

    #[test]
    fn each_flaw_is_recognised() {
        let room = room();
        let eye = Vec3::new(-2.8, 2.0, 2.3);
        // The tallest box spans 0.7..1.1 in x, 0..1.95 in y, 1.6..2.1 in z.
        let within = Vec3::new(2.5, 0.5, 1.8);
        assert_eq!(verdict(&room, within, within + Vec3::new(0.3, 0.1, 1.0)), Err(Flaw::Inside));
        assert_eq!(verdict(&room, Vec3::new(0.0, 2.5, 2.4), Vec3::new(0.0, 2.5, 2.5)), Err(Flaw::Blocked));
        assert_eq!(verdict(&room, Vec3::new(0.0, 2.9, 0.0), Vec3::new(0.05, 3.0, 0.0)), Err(Flaw::Blocked));
        assert_eq!(verdict(&room, 2.0 * eye, 3.0 * eye), Err(Flaw::Empty));
        let bare = cuboid(Vec3::splat(-1.0), Vec3::splat(1.0), true);
        assert_eq!(verdict(&bare, Vec3::ZERO, Vec3::X), Err(Flaw::Bare));
        let solid = cuboid(Vec3::splat(-1.0), Vec3::splat(1.0), false);
        assert_eq!(verdict(&solid, Vec3::ZERO, Vec3::X), Err(Flaw::Inside));
    }

    #[test]
    fn ground_is_not_content() {
        let scene = room();
        let tracer = Tracer::new(scene.clone());
        let view: View = serde_json::from_str(
            r#"{"eye":[-2.8,2,2.3],"target":[1,0.5,-1],"width":96,"height":54,"radius":1}"#,
        )
        .unwrap();
        let surface = render(&tracer, &view).unwrap();
        let subject = |ground_from| Subject { radius: 4.0, ground_from };
        assert!(judge(&surface, subject(u32::MAX), &CRITERIA).is_ok());
        assert_eq!(judge(&surface, subject(0), &CRITERIA), Err(Flaw::Empty));
    }
}
