//! OpenEXR as named planes of `f32`: what frames and AO images share.
//!
//! The `exr` crate parses headers and decompresses chunks. What a hostile file could use to make it
//! allocate is checked between the two, and a panic of its decoders becomes an error.

mod read;
mod write;

pub(crate) use read::{Channel, ExrFile};
pub(crate) use write::{Plane, encode};

fn format_error(expected: impl ToString, found: impl ToString) -> aonet::Error {
    aonet::Error::format("OpenEXR", expected, found)
}
