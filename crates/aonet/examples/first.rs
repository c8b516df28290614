//! Ambient occlusion of a frame that is made here: a wall, and in front of it two boards.
//!
//!     cargo run -p aonet --release --example first

use aonet::net::{Model, cpu::Session, shipped};
use aonet::{AoImage, AoParams, Camera, GBuffer, Size};

/// Depth along the viewing axis of the wall and of the boards (world units).
const WALL: f32 = 5.0;
const BOARDS: f32 = 4.8;

fn main() -> aonet::Result<()> {
    let size = Size::new(640, 360)?;
    let camera = Camera::perspective(60f32.to_radians(), size)?;

    // Yours, every frame: depth, infinite on the background, and unit normals in view space. All surfaces here face the viewer.
    let depth: Vec<f32> = pixels(size).map(|(x, y)| depth_at(&camera, x, y)).collect();
    let normal = vec![[0.0, 0.0, 1.0]; size.pixels()];

    let model = Model::from_bytes(shipped::BALANCED)?;
    let mut session = Session::new(&model, size, 2)?; // threads; allocates everything
    let mut ao = AoImage::open(size);
    let gbuffer = GBuffer::new(camera, &depth, &normal)?; // checks and borrows
    session.run(&gbuffer, AoParams::new(0.5)?, &mut ao)?; // radius in world units; allocates nothing

    let at = |x: usize, y: usize| ao.visibility()[y * size.width() + x];
    println!("mean visibility      {:.3}", mean(ao.visibility()));
    println!("wall, far from both  {:.3}", at(20, 20));
    println!("wall, between both   {:.3}", at(size.width() / 2, size.height() / 2));
    Ok(())
}

/// Columns and rows, row by row from the top.
fn pixels(size: Size) -> impl Iterator<Item = (usize, usize)> {
    (0..size.height()).flat_map(move |y| (0..size.width()).map(move |x| (x, y)))
}

/// The boards stand left and right of the middle, 0.2 apart.
fn depth_at(camera: &Camera, x: usize, y: usize) -> f32 {
    let p = camera.position_view(x, y, BOARDS);
    let is_board = (0.1..0.9).contains(&p.x.abs()) && p.y.abs() < 1.0;
    if is_board { BOARDS } else { WALL }
}

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}
