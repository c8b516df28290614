//! Real files, where there are any: the folder `scenes` in the folder that AONET_DATA names.

use super::super::load;
use super::*;
use std::path::PathBuf;
use std::time::{Duration, Instant};

fn scenes() -> Option<PathBuf> {
    let folder = std::env::var_os("AONET_DATA").map(|data| PathBuf::from(data).join("scenes"));
    if folder.is_none() {
        eprintln!("skipped: AONET_DATA is not set");
    }
    folder
}

struct Row {
    name: String,
    triangles: usize,
    has_normals: bool,
}

/// Rows of a table with a header; commas inside quotes do not separate.
fn rows(csv: &str) -> Vec<Row> {
    let fields = |line: &str| -> Vec<String> {
        let mut quoted = false;
        let separates = |c| {
            quoted ^= c == '"';
            c == ',' && !quoted
        };
        line.split(separates).map(str::to_owned).collect()
    };
    let mut lines = csv.lines();
    let header = fields(lines.next().unwrap());
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    let (name, triangles, normals) = (column("name"), column("triangles"), column("normals"));
    let row = |line| {
        let f = fields(line);
        Row {
            name: f[name].clone(),
            triangles: f[triangles].parse().unwrap(),
            has_normals: f[normals] == "yes",
        }
    };
    lines.map(row).collect()
}

/// Largest angle between a triangle and the normals at its corners (degrees).
fn largest_bend(scene: &Scene) -> f64 {
    let bend = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| scene.position[i as usize].as_dvec3());
        let face = (b - a).cross(c - a);
        let angles = t.map(|i| face.angle_between(scene.normal[i as usize].as_dvec3()).to_degrees());
        angles.into_iter().fold(0.0, f64::max)
    };
    scene.triangle.iter().map(bend).fold(0.0, f64::max)
}

#[test]
fn every_scene_loads_with_the_triangles_of_its_table() {
    let Some(folder) = scenes() else { return };
    let table = rows(&std::fs::read_to_string(folder.join("scenes.csv")).unwrap());
    assert!(table.len() > 100, "{}", table.len());
    let mut slowest = (Duration::ZERO, String::new());
    for Row { name, triangles, has_normals } in table {
        let start = Instant::now();
        let scene = load(&folder.join(format!("{name}.glb")), MissingNormals::CREASE).unwrap();
        slowest = slowest.max((start.elapsed(), name.clone()));
        // Measured: at most 40 degenerate triangles (desert_track), dropped.
        let dropped =
            triangles.checked_sub(scene.triangle.len()).unwrap_or_else(|| panic!("{name}: too many"));
        assert!(dropped <= triangles / 2000, "{name}: {dropped} of {triangles} triangles dropped");
        let bounds = scene.bounds();
        assert!(bounds.min.y.abs() < 1e-3 * bounds.radius(), "{name} does not stand on y = 0: {bounds:?}");
        if !has_normals {
            let bend = largest_bend(&scene);
            assert!(bend < 40.1, "{name}: a normal is {bend} degrees off its face");
            let flat = load(&folder.join(format!("{name}.glb")), MissingNormals::Flat).unwrap();
            assert_eq!(flat.triangle.len(), scene.triangle.len());
            assert!(flat.normal.len() >= scene.normal.len() && largest_bend(&flat) < 0.1, "{name}");
            println!(
                "{name}: {bend:.1} degrees, {} vertices, flat {}",
                scene.normal.len(),
                flat.normal.len()
            );
        }
    }
    println!("slowest: {} in {:?}", slowest.1, slowest.0);
}
