//! A guard band and a second layer: what the picture alone hides. A board floats in front of a wall; light reaches the wall behind
//! it, which only the second layer shows. A second board is outside of the picture, in its guard band.
//!
//!     cargo run -p aonet --release --example second_layer

use aonet::net::{Model, cpu::Session, shipped};
use aonet::{AoImage, AoParams, Camera, GBuffer, Margin, SecondLayer, Size, Window};

/// Depth along the viewing axis of the wall and of the boards (world units).
const WALL: f32 = 5.0;
const BOARDS: f32 = 4.4;

fn main() -> aonet::Result<()> {
    let size = Size::new(640, 360)?;
    let camera = Camera::perspective(60f32.to_radians(), size)?;
    let model = Model::from_bytes(shipped::BALANCED)?;
    let params = AoParams::new(1.0)?;

    // The picture alone.
    let depth = first_layer(&camera);
    let normal = vec![[0.0, 0.0, 1.0]; depth.len()];
    let alone = run(&model, &GBuffer::new(camera, &depth, &normal)?, params)?;

    // 15 % more on each side: the camera, depth and normals cover the picture and its guard band. Behind the boards is the wall;
    // where nothing is hidden, both layers have the same depth.
    let margin = Margin::share(size, 0.15);
    let wide = camera.with_margin(margin)?;
    let depth = first_layer(&wide);
    let normal = vec![[0.0, 0.0, 1.0]; depth.len()];
    let second = SecondLayer { depth: vec![WALL; depth.len()].into(), normal: None };
    let gbuffer = GBuffer::new(wide, &depth, &normal)?.with_margin(margin)?.with_second(second)?;
    assert_eq!(gbuffer.window(), Window::new(size, margin)?);
    let surrounded = run(&model, &gbuffer, params)?;

    // Images are of the picture, without the guard band.
    assert_eq!([alone.size(), surrounded.size()], [size; 2]);
    let rows =
        [("wall beside the board", size.width() / 2 - 52), ("wall at the right edge", size.width() - 2)];
    println!("{:<24}{:>8}{:>14}", "visibility", "alone", "with both");
    for (what, x) in rows {
        let [alone, surrounded] = [&alone, &surrounded].map(|ao| ao.visibility()[size.pixels() / 2 + x]);
        println!("{what:<24}{alone:>8.3}{surrounded:>14.3}");
    }
    Ok(())
}

/// Sessions take the window of a frame. In a program that draws many frames, one session serves all of the same window.
fn run(model: &Model, gbuffer: &GBuffer, params: AoParams) -> aonet::Result<AoImage> {
    let window = gbuffer.window();
    let mut session = Session::new(model, window, 2)?;
    let mut ao = AoImage::open(window.size());
    session.run(gbuffer, params, &mut ao)?;
    Ok(ao)
}

/// Depth, row by row from the top. One board is in the middle, the other starts at the picture's right edge.
fn first_layer(camera: &Camera) -> Vec<f32> {
    let of = |(x, y)| {
        let p = camera.position_view(x, y, BOARDS);
        let is_board = p.x.abs() < 0.5 || p.x > 4.52;
        if is_board { BOARDS } else { WALL }
    };
    let pixels = (0..camera.height()).flat_map(|y| (0..camera.width()).map(move |x| (x, y)));
    pixels.map(of).collect()
}
