//! OpenEXR files as named planes of `f32`, for frames and AO images.
//!
//! The `exr` crate parses headers and decompresses chunks. Between the two, values by which a hostile file could
//! cause large allocations are checked. A panic of its decoders becomes an error.

mod read;
mod write;

pub(crate) use read::{Channel, ExrFile};
pub(crate) use write::{Plane, encode_frame, encode_images};

fn format_error(expected: impl ToString, found: impl ToString) -> aonet::Error {
    aonet::Error::format("OpenEXR", expected, found)
}
