//! Topologies: each builds a graph from a configuration.

pub(crate) mod ao_net;
