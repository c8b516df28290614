use aonet::net::cpu::{Level, Session};
use aonet::net::*;
use aonet::*;
use std::time::Instant;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let config = ModelConfig::paper();
    let graph = Graph::new(&config).unwrap();
    let model = Model::new(config, Weights::init(&graph, 1), TrainingFacts::default()).unwrap();
    let (w, h) = (1280, 720);
    let threads = args.get(1).map_or(1, |a| a.parse().unwrap());
    for level in Level::available() {
        if args.get(2).is_some_and(|a| *a != format!("{level:?}")) {
            continue;
        }
        let view = (glam::Vec3::ZERO, -glam::Vec3::Z, glam::Vec3::Y);
        let camera = Camera::look_at(view, Projection::Perspective { fov_y: 0.1 }, (w, h), 0.0).unwrap();
        let g = GBuffer::new(camera, vec![1.0; w * h], vec![[0.0, 0.0, 1.0]; w * h]).unwrap();
        let mut image = AoImage::open(w, h).unwrap();
        let mut s = Session::with_level(&model, (w, h), threads, level).unwrap();
        let mut times = vec![];
        for _ in 0..args.get(3).map_or(12, |a| a.parse().unwrap()) {
            let t = Instant::now();
            s.run(&g, AoParams { radius: 1.0 }, &mut image).unwrap();
            times.push(t.elapsed().as_secs_f64() * 1e3);
        }
        times.sort_by(f64::total_cmp);
        let flop = 2.0 * graph.macs_per_pixel() * (w * h) as f64;
        println!(
            "{level:?} {w}x{h} {threads}T min {:.1} median {:.1} ms, {:.0} GFLOP/s (min)",
            times[0],
            times[times.len() / 2],
            flop / times[0] / 1e6
        );
    }
}
