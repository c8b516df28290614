//! Topologies: each builds a graph from a configuration.

pub(crate) mod ao_net;
pub(crate) mod deep_ao;
pub(crate) mod deep_shading;

use crate::net::graph::{Activation, Graph, Op, ValueId};

/// Appends a convolution: name, size, groups and activation.
fn conv(graph: &mut Graph, input: ValueId, of: (&str, usize, usize, Activation), channels: usize) -> ValueId {
    let (name, size, groups, activation) = of;
    graph.push(Op::Conv { input, name: name.to_owned(), size, groups, activation }, channels)
}
