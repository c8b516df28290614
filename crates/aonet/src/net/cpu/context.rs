//! What every step of a session works with.

use crate::simd::Isa;
use crate::threads::Workers;

/// Instructions, threads and activations of a session.
pub(super) struct Context<'a> {
    pub(super) isa: Isa,
    pub(super) workers: &'a mut Workers,
    /// All buffers of the plan.
    pub(super) arena: &'a mut [f32],
}
