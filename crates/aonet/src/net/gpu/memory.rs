//! Where the activations of a plan are: tensors that are not needed at the same time share a buffer.
//!
//! Not one arena, as on the CPU: a dispatch may not read and write parts of the same buffer, and a shader sees 128 MiB
//! of a buffer at most.

use crate::gpu::program::BufferId as ProgramBuffer;
use crate::gpu::program::{Dispatches, Grid, Number};
use crate::net::gpu::grids::Grids;
use crate::net::plan::{Buffer, BufferId, Layout};

/// Channels that lie side by side.
pub(crate) const BLOCK: usize = 4;

/// Blocks of channels.
pub(crate) fn blocks(channels: usize) -> usize {
    channels.div_ceil(BLOCK)
}

/// Buffers that tensors share.
#[derive(Debug)]
pub(crate) struct Memory {
    buffers: Vec<ProgramBuffer>,
    /// By tensor of the plan.
    place: Vec<usize>,
}

impl Memory {
    /// Adds memory for the tensors of the smallest plan to the list. Which tensors share a buffer depends neither on the size of
    /// the frames nor on the precision.
    pub(crate) fn new(tensors: &[Buffer], grids: &Grids, list: &mut Dispatches) -> Self {
        let (place, count) = share(tensors, values);
        let most = |buffer: usize, image: bool| {
            let there = tensors.iter().zip(&place).filter(|(_, place)| **place == buffer);
            let alike = there.filter(|(b, _)| (b.layout == Layout::Image) == image);
            alike.map(|(b, _)| if image { b.channels } else { values(b) }).max().unwrap_or(0)
        };
        let bytes = |buffer: usize| {
            let cells = Number::from(most(buffer, false)) * Number::REAL_BYTES * grids.repeats.clone();
            // What searches find is 32-bit in every arithmetic.
            let images = Number::from(most(buffer, true) * size_of::<f32>()) * Grid::FRAME.count();
            cells.max(images)
        };
        let buffers = (0..count).map(|buffer| list.storage("activations", bytes(buffer))).collect();
        Self { buffers, place }
    }

    /// Where a tensor is.
    pub(crate) fn of(&self, tensor: BufferId) -> ProgramBuffer {
        self.buffers[self.place[tensor]]
    }
}

/// Values of a tensor, with those that fill its last block.
fn values(tensor: &Buffer) -> usize {
    let channels = match tensor.layout {
        Layout::Planar | Layout::Blocked => blocks(tensor.channels) * BLOCK,
        Layout::Image => tensor.channels,
    };
    channels * tensor.height * tensor.width
}

/// The buffer of each tensor, and the number of buffers: the smallest free one that is large enough, or the largest free
/// one, enlarged, or a new one.
fn share(tensors: &[Buffer], values: impl Fn(&Buffer) -> usize) -> (Vec<usize>, usize) {
    let (mut place, mut sizes) = (Vec::<usize>::new(), Vec::<usize>::new());
    for tensor in tensors {
        let needed = values(tensor);
        let busy = |buffer: usize| {
            let at_once = |b: &Buffer| b.live.overlaps(tensor.live);
            place.iter().zip(tensors).any(|(p, other)| *p == buffer && at_once(other))
        };
        let free = (0..sizes.len()).filter(|buffer| !busy(*buffer));
        // How much must be added comes first, then how much is left over.
        let waste = |buffer: &usize| (needed.saturating_sub(sizes[*buffer]), sizes[*buffer]);
        let found = free.min_by_key(waste).unwrap_or(sizes.len());
        if found == sizes.len() {
            sizes.push(0);
        }
        sizes[found] = sizes[found].max(needed);
        place.push(found);
    }
    (place, sizes.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::size::Size;
    use crate::gpu::options::Precision;
    use crate::net::ModelConfig;
    use crate::net::gpu::grids::smallest_plan;
    use crate::net::graph::Graph;
    use crate::net::plan::Plan;

    #[test]
    fn tensors_of_one_buffer_never_live_at_once() {
        for config in [ModelConfig::paper(), ModelConfig::balanced(), ModelConfig::deep_ao()] {
            let graph = Graph::new(&config).unwrap();
            let smallest = smallest_plan(&graph).unwrap();
            let mut list = Dispatches::default();
            let memory = Memory::new(&smallest.buffers, &Grids::new(&smallest), &mut list);
            for size in [Size::px(1, 1), Size::px(640, 360), Size::px(1000, 1)] {
                let plan = Plan::new(&graph, size).unwrap();
                for precision in [Precision::F32, Precision::F16] {
                    let parts = list.at(size, precision).unwrap();
                    for (i, a) in plan.buffers.iter().enumerate() {
                        let real = if a.layout == Layout::Image { 4 } else { precision.bytes() };
                        assert!(parts.buffers[memory.of(i)].bytes >= (values(a) * real) as u64, "{size}");
                    }
                }
                for (i, a) in plan.buffers.iter().enumerate() {
                    for (j, b) in plan.buffers.iter().enumerate().filter(|(j, _)| *j != i) {
                        let at_once = a.live.overlaps(b.live);
                        assert!(!(at_once && memory.of(i) == memory.of(j)), "{i} and {j}");
                    }
                }
                assert!(list.buffers.len() < plan.buffers.len(), "something is shared");
            }
        }
    }
}
