//! Measured peak rates of this machine: multiplications, and copies beyond the caches.

use aonet::internals::multiply_add;
use aonet::net::cpu::Options;
use aonet_scene::Result;
use std::hint::black_box;
use std::sync::Barrier;
use std::time::Instant;

/// Multiplications of each sum in a round: a few milliseconds, short enough that some round is undisturbed.
const MULTIPLICATIONS: u32 = 1 << 20;

/// Values that a round copies, all threads together: source and target are larger than the caches of most machines.
const COPIED: usize = 48 << 20;

/// Rounds, of which the best counts: of multiplications, and of copies.
const ROUNDS: [usize; 2] = [30, 9];

/// Peaks of some threads of this machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peaks {
    /// Multiply-adds in registers, two operations each (GFLOP/s).
    pub gflop_per_s: f64,
    /// Bytes read plus bytes written by a copy in main memory (GB/s).
    pub copy_gb_per_s: f64,
}

impl Peaks {
    /// Measures the threads, instructions and precision of these options.
    ///
    /// # Errors
    /// When the machine does not have the instructions.
    pub fn measure(options: Options) -> Result<Self> {
        let threads = options.threads.max(1);
        // Missing instructions are reported here; the rounds cannot fail.
        multiply_add(options, 1)?;
        let multiply = |_: &mut ()| multiply_add(options, MULTIPLICATIONS).unwrap_or(0.0);
        let gflop_per_s = best(vec![(); threads], ROUNDS[0], &multiply);
        let values = COPIED / threads;
        let copy = |(from, to): &mut (Vec<f32>, Vec<f32>)| {
            to.copy_from_slice(black_box(from));
            black_box(&*to);
            (2 * size_of::<f32>() * to.len()) as f64
        };
        let buffers = (0..threads).map(|i| (vec![i as f32 + 1.0; values], vec![1.0; values])).collect();
        Ok(Self { gflop_per_s, copy_gb_per_s: best(buffers, ROUNDS[1], &copy) })
    }
}

/// The best rate of some rounds (1e9/s), from the amounts that `work` returns, by one thread for each of `states`.
fn best<T: Send>(mut states: Vec<T>, rounds: usize, work: &(dyn Fn(&mut T) -> f64 + Sync)) -> f64 {
    let barrier = Barrier::new(states.len());
    let round = |state: &mut T| {
        barrier.wait();
        let start = Instant::now();
        let done = work(state);
        barrier.wait();
        (done, start.elapsed().as_secs_f64())
    };
    let all = |state: &mut T| -> Vec<(f64, f64)> { (0..rounds).map(|_| round(state)).collect() };
    std::thread::scope(|scope| {
        let threads: Vec<_> = states.iter_mut().map(|state| scope.spawn(|| all(state))).collect();
        let found: Vec<_> = threads.into_iter().map(|t| t.join().expect("a round does not panic")).collect();
        // All threads share the time from the first start to the last end: one that is done early, or starts late, does not make the
        // machine faster.
        let rate = |i: usize| {
            let (done, seconds) =
                found.iter().fold((0.0, 0f64), |(done, longest), of| (done + of[i].0, longest.max(of[i].1)));
            done / seconds / 1e9
        };
        (0..rounds).map(rate).fold(0.0, f64::max)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use aonet::simd::Level;

    #[test]
    fn peaks_are_those_of_a_computer() {
        let peaks = Peaks::measure(Options { level: Level::Portable, ..Options::default() }).unwrap();
        // A processor with SSE2 does more than this per cycle at 0.2 GHz, and none has a thousand GFLOP/s a core.
        assert!((0.5..2000.0).contains(&peaks.gflop_per_s), "{peaks:?}");
        assert!((0.2..2000.0).contains(&peaks.copy_gb_per_s), "{peaks:?}");
    }

    #[test]
    fn rates_add_up_over_threads_and_count_all_of_their_time() {
        let sleep = |ms: &mut u64| {
            std::thread::sleep(std::time::Duration::from_millis(*ms));
            1e9
        };
        // One of the two sleeps longer: both have then done 1e9 in its time.
        let rate = best(vec![1, 20], 3, &sleep);
        assert!(rate > 1.0 && rate <= 2.0 / 0.020, "{rate}");
    }
}
