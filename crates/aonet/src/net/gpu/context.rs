//! What the dispatches of one size have in common.

use crate::gpu::program::Arithmetic;
use crate::gpu::surface::Surface;
use crate::net::gpu::memory::Memory;
use crate::net::plan::Plan;

/// How the dispatches of one size compute, and where their tensors are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Context<'a> {
    pub(crate) arithmetic: Arithmetic,
    pub(crate) surface: Surface,
    pub(crate) plan: &'a Plan,
    pub(crate) memory: &'a Memory,
}
