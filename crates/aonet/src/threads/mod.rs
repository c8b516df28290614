//! Threads that a session owns, and work over the rows of an image.

mod bands;
mod pool;

pub(crate) use bands::{Band, Workers};
