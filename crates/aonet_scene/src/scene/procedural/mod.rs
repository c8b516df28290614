//! Seeded scenes made from code: what a user has without a download, and what networks are trained on.
//!
//! Metres, +Y up, ground about y = 0. Equal kinds and seeds give equal scenes on every machine.

mod apartment;
mod architecture;
mod car_park;
mod cave;
mod clutter;
mod corridor;
mod drapes;
mod furniture;
mod hall;
mod library;
mod machine;
mod mesh;
mod pipeworks;
mod plants;
mod props;
mod rng;
mod room;
mod sculpture;
mod settle;
mod shapes;
mod solid;
mod staircase;
mod storeroom;
mod street;
mod tabletop;
mod terrain;
mod thicket;
mod tools;
mod toys;
mod vehicle;
mod village;
mod workshop;

use super::Scene;
use crate::error::{Error, Result};
use crate::view::View;
use rng::Rng;
use std::fmt;
use std::str::FromStr;

/// What a procedural scene shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Kind {
    /// A living room, bedroom, dining room or study.
    FurnishedRoom,
    /// A hall with two rows of columns.
    Hall,
    /// Many rigid things that lie on each other.
    ClutterPile,
    /// Hills with trees, rocks and grass.
    Terrain,
    /// A street with houses, cars and lamps.
    Street,
    /// Sculptures on plinths.
    Sculpture,
    /// A cave with dripstones.
    Cave,
    /// Arches of rock on open ground.
    RockArch,
    /// Tanks, pipes, gears.
    Machine,
    /// A stairwell with straight and spiral stairs.
    Staircase,
    /// A laid table from near.
    Tabletop,
    /// Walls of books around a reading table.
    Library,
    /// A workshop or kitchen along two walls.
    Workshop,
    /// Cottages and a church around a green.
    Village,
    /// Towers, trains and castles of toy blocks.
    ToyBlocks,
    /// Cloth over things and hanging in folds.
    Drapes,
    /// The inside of a space ship.
    Corridor,
    /// Furnished rooms along a corridor, seen through their doors.
    Apartment,
    /// Racks full of boxes, bins and cans along aisles.
    Storeroom,
    /// Parked cars, in part under a deck or a carport.
    CarPark,
    /// Hedges, bushes, ferns and climbers on a trellis.
    Thicket,
    /// Bundles of pipes, ducts and cable trays on racks.
    Pipeworks,
}

impl Kind {
    /// Every kind.
    pub const ALL: &[Self] = &[
        Self::FurnishedRoom,
        Self::Hall,
        Self::ClutterPile,
        Self::Terrain,
        Self::Street,
        Self::Sculpture,
        Self::Cave,
        Self::RockArch,
        Self::Machine,
        Self::Staircase,
        Self::Tabletop,
        Self::Library,
        Self::Workshop,
        Self::Village,
        Self::ToyBlocks,
        Self::Drapes,
        Self::Corridor,
        Self::Apartment,
        Self::Storeroom,
        Self::CarPark,
        Self::Thicket,
        Self::Pipeworks,
    ];

    /// The name in snake_case.
    pub fn name(self) -> &'static str {
        match self {
            Self::FurnishedRoom => "furnished_room",
            Self::Hall => "hall",
            Self::ClutterPile => "clutter_pile",
            Self::Terrain => "terrain",
            Self::Street => "street",
            Self::Sculpture => "sculpture",
            Self::Cave => "cave",
            Self::RockArch => "rock_arch",
            Self::Machine => "machine",
            Self::Staircase => "staircase",
            Self::Tabletop => "tabletop",
            Self::Library => "library",
            Self::Workshop => "workshop",
            Self::Village => "village",
            Self::ToyBlocks => "toy_blocks",
            Self::Drapes => "drapes",
            Self::Corridor => "corridor",
            Self::Apartment => "apartment",
            Self::Storeroom => "storeroom",
            Self::CarPark => "car_park",
            Self::Thicket => "thicket",
            Self::Pipeworks => "pipeworks",
        }
    }

    /// Whether walls and a ceiling surround the scene, so that a camera belongs inside.
    pub fn is_interior(self) -> bool {
        match self {
            Self::FurnishedRoom
            | Self::Hall
            | Self::Cave
            | Self::Staircase
            | Self::Library
            | Self::Corridor
            | Self::Apartment
            | Self::Storeroom => true,
            Self::ClutterPile
            | Self::Terrain
            | Self::Street
            | Self::Sculpture
            | Self::RockArch
            | Self::Machine
            | Self::Tabletop
            | Self::Workshop
            | Self::Village
            | Self::ToyBlocks
            | Self::Drapes
            | Self::CarPark
            | Self::Thicket
            | Self::Pipeworks => false,
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Kind {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let names: Vec<&str> = Self::ALL.iter().map(|k| k.name()).collect();
        let known = Self::ALL.iter().copied().find(|k| k.name() == name);
        known.ok_or_else(|| Error::request("procedural scene", format!("one of {}", names.join(", ")), name))
    }
}

/// The scene of a kind; other seeds give other layouts, counts, proportions and styles.
pub fn build(kind: Kind, seed: u64) -> Scene {
    let mut rng = Rng::new(seed).of(kind.name());
    let mesh = match kind {
        Kind::FurnishedRoom => room::room(&mut rng),
        Kind::Hall => hall::hall(&mut rng),
        Kind::ClutterPile => clutter::pile(&mut rng),
        Kind::Terrain => terrain::terrain(&mut rng),
        Kind::Street => street::street(&mut rng),
        Kind::Sculpture => sculpture::court(&mut rng),
        Kind::Cave => cave::cave(&mut rng),
        Kind::RockArch => cave::arch(&mut rng),
        Kind::Machine => machine::plant(&mut rng),
        Kind::Staircase => staircase::stairwell(&mut rng),
        Kind::Tabletop => tabletop::meal(&mut rng),
        Kind::Library => library::library(&mut rng),
        Kind::Workshop => workshop::workshop(&mut rng),
        Kind::Village => village::village(&mut rng),
        Kind::ToyBlocks => toys::blocks(&mut rng),
        Kind::Drapes => drapes::drapes(&mut rng),
        Kind::Corridor => corridor::corridor(&mut rng),
        Kind::Apartment => apartment::apartment(&mut rng),
        Kind::Storeroom => storeroom::storeroom(&mut rng),
        Kind::CarPark => car_park::car_park(&mut rng),
        Kind::Thicket => thicket::thicket(&mut rng),
        Kind::Pipeworks => pipeworks::pipeworks(&mut rng),
    };
    mesh.into_scene(format!("procedural:{kind}:{seed}"))
}

/// A living room and a view of it that show ambient occlusion well.
pub fn demo() -> (Scene, View) {
    let view = View {
        eye: [1.55, 1.5, 1.75],
        target: [-1.2, 0.75, -1.5],
        up: [0.0, 1.0, 0.0],
        fov_y_deg: 58.0,
        ortho_height: None,
        width: 1280,
        height: 720,
        near: 0.05,
        far: f32::INFINITY,
        radius: 0.5,
        margin: 0.0,
        separation: None,
    };
    (build(Kind::FurnishedRoom, 20), view)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gbuffer;
    use crate::trace::Tracer;
    use glam::Vec3;
    use rayon::prelude::*;

    /// Share of a scene's triangles whose winding contradicts the mean of their shading normals.
    fn contradicting(scene: &Scene) -> f32 {
        let against = |t: &&[u32; 3]| {
            let [a, b, c] = t.map(|i| scene.position[i as usize]);
            let normal: Vec3 = t.iter().map(|&i| scene.normal[i as usize]).sum();
            (b - a).cross(c - a).dot(normal) < 0.0
        };
        scene.triangle.iter().filter(against).count() as f32 / scene.triangle.len() as f32
    }

    #[test]
    fn every_kind_is_sane_and_repeatable_and_seeds_differ() {
        Kind::ALL.par_iter().for_each(|&kind| {
            let scenes = [0, 1, u64::MAX].map(|seed| build(kind, seed).checked().unwrap());
            for scene in &scenes {
                let n = scene.triangle.len();
                assert!((20_000..450_000).contains(&n), "{}: {n} triangles", scene.name);
                let size = scene.bounds().max - scene.bounds().min;
                assert!(size.min_element() > 0.3 && size.max_element() < 80.0, "{}: {size}", scene.name);
                assert!(contradicting(scene) < 1e-4, "{}: {}", scene.name, contradicting(scene));
            }
            assert_eq!(scenes[0], build(kind, 0), "{kind}");
            let [a, b, c] = scenes.map(|s| s.position);
            assert!(a != b && b != c && a != c, "{kind}");
        });
    }

    #[test]
    fn a_turned_triangle_contradicts() {
        let mut scene = build(Kind::Hall, 0);
        scene.triangle.iter_mut().step_by(2).for_each(|t| t.swap(0, 1));
        assert!((contradicting(&scene) - 0.5).abs() < 0.01);
    }

    #[test]
    fn names_round_trip_and_strangers_are_told_the_names() {
        assert!(Kind::ALL.iter().all(|k| k.to_string().parse::<Kind>().unwrap() == *k));
        let message = "moon".parse::<Kind>().unwrap_err().to_string();
        assert!(message.contains("moon") && message.contains("clutter_pile"), "{message}");
    }

    #[test]
    fn the_demo_fills_its_image_with_fronts() {
        let (scene, view) = demo();
        let small = View { width: 128, height: 72, ..view };
        let surface = gbuffer::render(&Tracer::new(scene), &small).unwrap();
        let pixels = surface.backface.len();
        let seen = (0..pixels).filter(|&i| surface.gbuffer.is_foreground(i)).count();
        let backs = surface.backface.iter().filter(|&&b| b).count();
        assert!(seen * 10 > pixels * 9 && backs * 50 < pixels, "{seen} seen, {backs} backs of {pixels}");
    }
}
