//! ONNX nodes one after the other; a node's name is also the name of what it produces.

use super::proto;
use aonet::internals::weights::Tensor;
use std::collections::BTreeSet;

/// The nodes and constants of a graph that grows.
#[derive(Debug, Default)]
pub(super) struct Writer {
    pub(super) nodes: Vec<proto::Node>,
    pub(super) constants: Vec<proto::Tensor>,
    names: BTreeSet<String>,
}

/// The value of an attribute.
#[derive(Debug, Clone, Copy)]
pub(super) enum Attribute<'a> {
    Float(f32),
    Int(usize),
    Ints(&'a [usize]),
    Text(&'a str),
}

impl Writer {
    /// Appends a node; returns its name.
    ///
    /// # Panics
    /// When the name is taken: a bug of the caller.
    pub(super) fn node(
        &mut self,
        (name, op_type): (&str, &str),
        inputs: &[&str],
        attributes: &[(&str, Attribute<'_>)],
    ) -> String {
        assert!(self.names.insert(name.to_owned()), "two nodes called {name}");
        self.nodes.push(proto::Node {
            input: inputs.iter().map(|&i| i.to_owned()).collect(),
            output: vec![name.to_owned()],
            name: name.to_owned(),
            op_type: op_type.to_owned(),
            attribute: attributes.iter().map(|(name, value)| attribute(name, *value)).collect(),
        });
        name.to_owned()
    }

    /// A constant list of integers, named after what it holds; equal lists are one constant.
    pub(super) fn ints(&mut self, values: &[i64]) -> String {
        let name = format!("ints{values:?}").replace(' ', "");
        let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.constant(&name, (&[values.len()], proto::DataType::Int64), bytes)
    }

    /// A constant number without dimensions, named after its value.
    pub(super) fn scalar(&mut self, value: f32) -> String {
        self.constant(&format!("float[{value}]"), (&[], proto::DataType::Float), value.to_le_bytes().to_vec())
    }

    /// A constant tensor.
    pub(super) fn tensor(&mut self, name: &str, tensor: &Tensor) -> String {
        let bytes = tensor.values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.constant(name, (&tensor.shape, proto::DataType::Float), bytes)
    }

    fn constant(
        &mut self,
        name: &str,
        (shape, data_type): (&[usize], proto::DataType),
        raw_data: Vec<u8>,
    ) -> String {
        if self.names.insert(name.to_owned()) {
            let dims = shape.iter().map(|&side| side as i64).collect();
            let data_type = data_type.into();
            self.constants.push(proto::Tensor { dims, data_type, name: name.to_owned(), raw_data });
        }
        name.to_owned()
    }
}

fn attribute(name: &str, value: Attribute<'_>) -> proto::Attribute {
    let of = |r#type: proto::AttributeType| proto::Attribute {
        name: name.to_owned(),
        r#type: r#type.into(),
        ..proto::Attribute::default()
    };
    match value {
        Attribute::Float(f) => proto::Attribute { f: Some(f), ..of(proto::AttributeType::Float) },
        Attribute::Int(i) => proto::Attribute { i: Some(i as i64), ..of(proto::AttributeType::Int) },
        Attribute::Ints(list) => proto::Attribute {
            ints: list.iter().map(|&i| i as i64).collect(),
            ..of(proto::AttributeType::Ints)
        },
        Attribute::Text(text) => {
            proto::Attribute { s: Some(text.as_bytes().to_vec()), ..of(proto::AttributeType::String) }
        }
    }
}
