//! Where the activations of a plan are: tensors that are not needed at the same time share a buffer.
//!
//! Not one arena, as on the CPU: a dispatch may not read and write parts of the same buffer, and a shader sees 128 MiB
//! of a buffer at most.

use crate::gpu::program::BufferId as ProgramBuffer;
use crate::gpu::program::{Arithmetic, Dispatches};
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
    /// Adds memory for the tensors of a plan to the list.
    pub(crate) fn new(arithmetic: Arithmetic, tensors: &[Buffer], list: &mut Dispatches) -> Self {
        let bytes = |b: &Buffer| match b.layout {
            Layout::Planar | Layout::Blocked => {
                blocks(b.channels) * BLOCK * b.height * b.width * arithmetic.real_bytes()
            }
            // What searches find is 32-bit in every arithmetic.
            Layout::Image => b.channels * b.height * b.width * size_of::<f32>(),
        };
        let (place, sizes) = share(tensors, bytes);
        let buffers = sizes.iter().map(|bytes| list.storage("activations", *bytes)).collect();
        Self { buffers, place }
    }

    /// Where a tensor is.
    pub(crate) fn of(&self, tensor: BufferId) -> ProgramBuffer {
        self.buffers[self.place[tensor]]
    }
}

/// The buffer of each tensor, and the sizes of the buffers: the smallest free one that is large enough, or the largest free
/// one, enlarged, or a new one.
fn share(tensors: &[Buffer], bytes: impl Fn(&Buffer) -> usize) -> (Vec<usize>, Vec<usize>) {
    let (mut place, mut sizes) = (Vec::<usize>::new(), Vec::<usize>::new());
    for tensor in tensors {
        let needed = bytes(tensor);
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
    (place, sizes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::size::Size;
    use crate::net::ModelConfig;
    use crate::net::graph::Graph;
    use crate::net::plan::Plan;

    #[test]
    fn tensors_of_one_buffer_never_live_at_once() {
        for config in [ModelConfig::paper(), ModelConfig::balanced(), ModelConfig::deep_ao()] {
            let plan = Plan::new(&Graph::new(&config).unwrap(), Size::px(640, 360)).unwrap();
            let (place, sizes) = share(&plan.buffers, |b| b.channels * b.height * b.width);
            for (i, a) in plan.buffers.iter().enumerate() {
                assert!(sizes[place[i]] >= a.channels * a.height * a.width);
                for (j, b) in plan.buffers.iter().enumerate().filter(|(j, _)| *j != i) {
                    let at_once = a.live.overlaps(b.live);
                    assert!(!(at_once && place[i] == place[j]), "{i} and {j}");
                }
            }
            assert!(sizes.len() < plan.buffers.len(), "something is shared");
        }
    }
}
