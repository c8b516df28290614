//! The tensors of a plan and their places in one arena.

use crate::frame::size::Size;

/// Channels of blocked buffers are rounded up to a multiple of this: the widest vector of any backend.
pub const CHANNEL_BLOCK: usize = 16;

/// Pixels that every row carries on each side of the image, for 3x3 convolutions.
pub const HALO: usize = 1;

/// Index into [`Plan::buffers`](super::Plan::buffers).
pub type BufferId = usize;

/// How the values of a row are ordered. Rows always come one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// Channel by channel, each a line of pixels with its halo.
    Planar,
    /// Block of channels by block of channels, each a line of pixels with its halo, channels innermost.
    Blocked,
    /// The frame's own pixels, without halo, channel by channel.
    Image,
}

/// A tensor in the arena.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Buffer {
    /// First value in the arena.
    pub offset: usize,
    /// Order of the values.
    pub layout: Layout,
    /// Channels that hold values.
    pub channels: usize,
    /// Rows.
    pub height: usize,
    /// Columns, without the halo.
    pub width: usize,
    /// When its values are needed.
    pub live: Lifetime,
}

/// The steps between which a buffer holds values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lifetime {
    /// The step that writes it first.
    pub first: usize,
    /// The step that reads it last.
    pub last: usize,
}

impl Lifetime {
    /// Whether two buffers hold values during the same step.
    pub fn overlaps(self, other: Self) -> bool {
        self.first <= other.last && other.first <= self.last
    }
}

impl Buffer {
    /// Columns and rows, without the halo (px or cells).
    pub fn size(&self) -> Size {
        Size::px(self.width, self.height)
    }

    /// Values from the start of one row to the next.
    pub fn row_len(&self) -> usize {
        match self.layout {
            Layout::Planar => self.channels * (self.width + 2 * HALO),
            Layout::Blocked => self.channels.next_multiple_of(CHANNEL_BLOCK) * (self.width + 2 * HALO),
            Layout::Image => self.channels * self.width,
        }
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        self.height * self.row_len()
    }

    /// Returns false: every buffer has a row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The place of its values in the arena.
    pub fn range(&self) -> std::ops::Range<usize> {
        self.offset..self.offset + self.len()
    }
}

/// Puts each buffer at the lowest offset that no buffer of an overlapping lifetime occupies. Returns the length of the
/// arena, or none if it would not fit in the address space.
pub(super) fn place(buffers: &mut [Buffer]) -> Option<usize> {
    let mut arena_len = 0usize;
    for i in 0..buffers.len() {
        let (placed, rest) = buffers.split_at_mut(i);
        let buffer = &mut rest[0];
        let mut taken: Vec<_> =
            placed.iter().filter(|b| b.live.overlaps(buffer.live)).map(|b| b.range()).collect();
        taken.sort_by_key(|range| range.start);
        let len = buffer.height.checked_mul(buffer.row_len())?;
        let mut offset = 0usize;
        for range in taken {
            if offset.checked_add(len)? <= range.start {
                break;
            }
            offset = offset.max(range.end.next_multiple_of(CHANNEL_BLOCK));
        }
        buffer.offset = offset;
        arena_len = arena_len.max(offset.checked_add(len)?);
    }
    (arena_len <= isize::MAX as usize / size_of::<f32>()).then_some(arena_len)
}
