//! The CPU runtime.
