//! Tests that need what is private. Programs in C and C++ are in `tests/`, and `test` runs all.

mod layout;
