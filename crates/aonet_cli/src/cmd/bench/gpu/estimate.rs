//! Lower bounds of a pass's time on a device, and an estimate for a common device.

use aonet_lab::timing::gpu::PassCost;
use serde::Serialize;

/// Peak rates of a device.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Peaks {
    /// Operations (1e12 a second).
    pub(super) tflops: Option<f64>,
    /// Of memory (1e9 bytes a second).
    pub(super) gb_per_s: Option<f64>,
}

impl Peaks {
    /// The time of a pass's operations or of its traffic, whichever is longer (ms); none where no peak is known.
    pub(super) fn floor_ms(self, cost: &PassCost) -> Option<f64> {
        let flop_ms = self.tflops.map(|peak| cost.flop / peak / 1e9);
        let bytes_ms = self.gb_per_s.map(|peak| cost.bytes / peak / 1e6);
        match (flop_ms, bytes_ms) {
            (Some(flop), Some(bytes)) => Some(flop.max(bytes)),
            (one, other) => one.or(other),
        }
    }
}

/// A model of a device of the class of an RTX 3060: computed from counts, not measured.
#[derive(Debug, Clone, Copy, Serialize)]
pub(in crate::cmd) struct Estimate {
    pub(in crate::cmd) device: &'static str,
    pub(in crate::cmd) tflops: f64,
    pub(in crate::cmd) gb_per_s: f64,
    /// Shares of both peaks that shaders reach.
    pub(in crate::cmd) flop_efficiency: f64,
    pub(in crate::cmd) byte_efficiency: f64,
    /// Time between two passes (ms).
    pub(in crate::cmd) gap_ms: f64,
}

/// 3584 multiply-adds at 1.78 GHz in f32, and as many in f16 without matrix units; 192 bits at 15 Gbit/s: the
/// manufacturer's data sheet.
pub(in crate::cmd) const RTX_3060: Estimate = Estimate {
    device: "RTX 3060 class",
    tflops: 12.7,
    gb_per_s: 360.0,
    // guess: a tiled convolution without matrix units.
    flop_efficiency: 0.35,
    // guess: slightly below what copies reach.
    byte_efficiency: 0.75,
    // guess: a barrier and a launch.
    gap_ms: 0.005,
};

impl Estimate {
    /// Estimated time of a pass (ms).
    pub(in crate::cmd) fn ms(self, cost: &PassCost) -> f64 {
        let flop_ms = cost.flop / (self.tflops * self.flop_efficiency) / 1e9;
        let bytes_ms = cost.bytes / (self.gb_per_s * self.byte_efficiency) / 1e6;
        flop_ms.max(bytes_ms) + self.gap_ms
    }

    /// A sentence that explains the estimate.
    pub(in crate::cmd) fn sentence(self) -> String {
        let Self { device, tflops, gb_per_s, flop_efficiency, byte_efficiency, gap_ms } = self;
        format!(
            "estimate: not measured; counted operations at {:.0} % of {tflops} TFLOP/s or counted bytes at {:.0} % of {gb_per_s} \
             GB/s ({device}), whichever takes longer, and {:.0} µs a pass",
            100.0 * flop_efficiency,
            100.0 * byte_efficiency,
            1e3 * gap_ms
        )
    }
}
