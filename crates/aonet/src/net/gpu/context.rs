//! What the dispatches of a network have in common.

use crate::gpu::program::Arithmetic;
use crate::gpu::surface::Surface;
use crate::net::gpu::grids::Grids;
use crate::net::gpu::memory::Memory;
use crate::net::plan::Plan;

/// How dispatches compute, and where their tensors are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Context<'a> {
    pub(crate) arithmetic: Arithmetic,
    pub(crate) surface: Surface,
    /// The smallest plan; sides are those of the grids.
    pub(crate) plan: &'a Plan,
    pub(crate) grids: &'a Grids,
    pub(crate) memory: &'a Memory,
}
