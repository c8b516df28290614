//! Seeded scenes made from code.
