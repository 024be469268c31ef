//! The bytes of an ONNX file: `ModelProto` of onnx.proto, with the numbers of its fields.

use super::{Attribute, Constant, Graph, Node, Numbers};
use crate::{
    port::{Length, Port},
    protobuf::Message,
};

/// Version of ONNX's set of operations. 13 is the oldest one in which `ReduceSum` takes its axes as
/// an input, as all later ones do.
pub(crate) const OPSET: i64 = 13;
/// Version of the file format, that of opset 13's release.
const IR_VERSION: i64 = 7;

/// `TensorProto.DataType`.
#[derive(Clone, Copy)]
enum ElementType {
    Float = 1,
    Int64 = 7,
}

/// `AttributeProto.AttributeType`.
const ATTRIBUTE_INT: i64 = 2;
const ATTRIBUTE_INTS: i64 = 7;

/// Largest file that protobuf readers take, bytes.
pub(crate) const LARGEST_FILE: usize = i32::MAX as usize;

impl Graph {
    /// Returns the bytes of the file.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let mut opset = Message::default();
        // The empty domain is that of ONNX's own operations.
        opset.text(1, "");
        opset.int(2, OPSET);
        let mut model = Message::default();
        model.int(1, IR_VERSION);
        model.text(2, "unic");
        model.text(3, env!("CARGO_PKG_VERSION"));
        model.message(7, &self.graph_message());
        model.message(8, &opset);
        model.into_bytes()
    }

    fn graph_message(&self) -> Message {
        let mut graph = Message::default();
        for node in &self.nodes {
            graph.message(1, &self.node_message(node));
        }
        graph.text(2, self.name);
        for constant in &self.constants {
            graph.message(5, &self.tensor_message(constant));
        }
        for (field, ports) in [(11, &self.inputs), (12, &self.outputs)] {
            for (port, name) in ports {
                graph.message(field, &self.port_message(*port, name));
            }
        }
        graph
    }

    fn node_message(&self, node: &Node) -> Message {
        let mut message = Message::default();
        for input in &node.inputs {
            message.text(1, &self.names[input.0]);
        }
        let output = &self.names[node.output.0];
        message.text(2, output);
        message.text(3, output);
        message.text(4, node.operation);
        for &(name, value) in &node.attributes {
            message.message(5, &attribute_message(name, value));
        }
        message
    }

    fn tensor_message(&self, constant: &Constant) -> Message {
        let (element, bytes): (_, Vec<u8>) = match &constant.data {
            Numbers::Floats(x) => (
                ElementType::Float,
                x.iter().flat_map(|x| x.to_le_bytes()).collect(),
            ),
            Numbers::Integers(x) => (
                ElementType::Int64,
                x.iter().flat_map(|x| x.to_le_bytes()).collect(),
            ),
        };
        let mut message = Message::default();
        for &length in &constant.shape {
            message.int(1, length as i64);
        }
        message.int(2, element as i64);
        message.text(8, &self.names[constant.value.0]);
        message.bytes(9, &bytes);
        message
    }

    /// `ValueInfoProto`: every port has single-precision numbers.
    fn port_message(&self, port: Port, name: &str) -> Message {
        let mut shape = Message::default();
        for length in self.sizes.shape(port) {
            let mut dimension = Message::default();
            match length {
                Length::Fixed(length) => dimension.int(1, length as i64),
                Length::Named(name) => dimension.text(2, name),
            }
            shape.message(1, &dimension);
        }
        let mut tensor = Message::default();
        tensor.int(1, ElementType::Float as i64);
        tensor.message(2, &shape);
        let mut kind = Message::default();
        kind.message(1, &tensor);
        let mut message = Message::default();
        message.text(1, name);
        message.message(2, &kind);
        message.text(3, port.meaning);
        message
    }
}

fn attribute_message(name: &str, value: Attribute) -> Message {
    let mut message = Message::default();
    message.text(1, name);
    match value {
        Attribute::Int(value) => {
            message.int(3, value);
            message.int(20, ATTRIBUTE_INT);
        }
        Attribute::OneInt(value) => {
            message.int(8, value);
            message.int(20, ATTRIBUTE_INTS);
        }
    }
    message
}
