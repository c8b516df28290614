//! What the other crates of this workspace need beside the interface: graphs and plans, the oracle, vectors, random bits, and
//! what their shaders share with those of this crate.
//!
//! There is no promise of stability: anything in here may change in any version.

pub use crate::net::cpu::peak::multiply_add;

/// Random bits.
pub mod random {
    pub use crate::random::*;
}

/// Vector instructions.
pub mod simd {
    pub use crate::simd::level::Isa;
    pub use crate::simd::operations::{Kernel, MAX_LANES, Simd};
    pub use crate::simd::transpose::{columns, four};
}

/// The transforms of Winograd's convolution.
pub mod winograd {
    pub use crate::net::cpu::winograd_transforms::{IN, OUT, PRODUCTS, input, output};
}

/// Networks as graphs of operations.
pub mod graph {
    pub use crate::net::graph::*;
}

/// The kernels that heads predict.
pub mod kernel {
    pub use crate::net::kernel::*;
}

/// The neighbours whose visibility a network mixes in.
pub mod neighbours {
    pub use crate::net::neighbours::*;
}

/// Where the values of a graph lie in memory, and the steps that compute them.
pub mod plan {
    pub use crate::net::plan::*;
}

/// Parameters of networks.
pub mod weights {
    pub use crate::net::weights::*;
}

/// The channels that networks read.
pub mod features {
    pub use crate::net::features::*;
}

/// The oracle: every operation as plain loops.
pub mod naive {
    pub use crate::net::naive::*;
}

/// Shares of light.
pub mod shares {
    pub use crate::search::arcs::MOST_GRAZING;
    pub use crate::search::shares::{GAPS, SHARES};
    pub use crate::search::side::CONNECTED;
}

/// The network of NNAO.
pub mod nnao {
    pub use crate::search::nnao_taps::{INPUTS, NnaoTap, Spiral, taps};
    pub use crate::search::nnao_weights::*;
}

/// Pieces of programs for graphics processors.
pub mod gpu {
    pub use crate::gpu::surface::LENS;
    pub use crate::gpu::uniforms::{LENS_WORDS, Lens};
    #[cfg(feature = "gpu")]
    pub use crate::gpu::wgpu_30::bind;
    #[cfg(feature = "gpu")]
    pub use crate::gpu::wgpu_30::cover::{cleared, cover_pipeline};
    #[cfg(all(feature = "gpu", not(target_arch = "wasm32")))]
    pub use crate::gpu::wgpu_30::device::wait;
    #[cfg(feature = "gpu")]
    pub use crate::gpu::wgpu_30::errors::scoped;
}
