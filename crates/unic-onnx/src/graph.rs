//! Graph of operations, built node by node and written as an ONNX file.

mod file;
mod operations;

pub(crate) use file::{LARGEST_FILE, OPSET};

use crate::port::{Port, Role, Sizes};
use std::collections::HashMap;

/// Result of a node, a constant or an input of one graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Value(usize);

/// Graph that grows node by node. Nodes follow those whose results they read.
#[derive(Debug)]
pub(crate) struct Graph {
    name: &'static str,
    sizes: Sizes,
    nodes: Vec<Node>,
    constants: Vec<Constant>,
    inputs: Vec<(Port, String)>,
    outputs: Vec<(Port, String)>,
    /// Name of each value in the file.
    names: Vec<String>,
    /// Part of the model that nodes are named after.
    scope: &'static str,
    /// Constants that exist already, by shape and bits.
    shared: HashMap<(Vec<usize>, Vec<u32>), Value>,
    /// Integer constants that exist already.
    shared_integers: HashMap<Vec<i64>, Value>,
}

#[derive(Debug)]
struct Node {
    operation: &'static str,
    inputs: Vec<Value>,
    output: Value,
    attributes: Vec<(&'static str, Attribute)>,
}

/// Value of an attribute of a node.
#[derive(Clone, Copy, Debug)]
enum Attribute {
    /// An integer.
    Int(i64),
    /// A list of one integer.
    OneInt(i64),
}

#[derive(Debug)]
struct Constant {
    value: Value,
    shape: Vec<usize>,
    data: Numbers,
}

#[derive(Debug)]
enum Numbers {
    Floats(Vec<f32>),
    Integers(Vec<i64>),
}

impl Graph {
    /// Makes an empty graph for a model of these sizes.
    pub(crate) fn new(name: &'static str, sizes: Sizes) -> Self {
        Self {
            name,
            sizes,
            nodes: Vec::new(),
            constants: Vec::new(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            names: Vec::new(),
            scope: name,
            shared: HashMap::new(),
            shared_integers: HashMap::new(),
        }
    }

    /// Names the nodes that follow after a part of the model.
    pub(crate) fn scope(&mut self, scope: &'static str) {
        self.scope = scope;
    }

    /// Lengths of the axes that depend on the model.
    pub(crate) fn sizes(&self) -> &Sizes {
        &self.sizes
    }

    /// Name of the graph.
    pub(crate) fn name(&self) -> &'static str {
        self.name
    }

    /// Inputs in order, with their names.
    pub(crate) fn inputs(&self) -> &[(Port, String)] {
        &self.inputs
    }

    /// Outputs in order, with their names.
    pub(crate) fn outputs(&self) -> &[(Port, String)] {
        &self.outputs
    }

    /// Declares an input, or returns the one that is declared already.
    pub(crate) fn input(&mut self, port: Port) -> Value {
        if let Some(known) = self.names.iter().position(|name| name == port.name) {
            return Value(known);
        }
        self.inputs.push((port, port.name.to_owned()));
        self.named(port.name.to_owned())
    }

    /// Declares an output. The output of a state is its value after the tick and has the name for
    /// that.
    pub(crate) fn output(&mut self, port: Port, value: Value) {
        let name = match port.role {
            Role::State => port.next_name(),
            _ => port.name.to_owned(),
        };
        self.outputs.push((port, name.clone()));
        let output = self.named(name);
        self.nodes.push(Node {
            operation: "Identity",
            inputs: vec![value],
            output,
            attributes: Vec::new(),
        });
    }

    /// Adds a constant; equal ones are stored once.
    pub(crate) fn constant(&mut self, shape: &[usize], numbers: &[f32]) -> Value {
        debug_assert_eq!(shape.iter().product::<usize>(), numbers.len(), "{shape:?}");
        let bits = numbers.iter().map(|x| x.to_bits()).collect();
        let key = (shape.to_vec(), bits);
        if let Some(&known) = self.shared.get(&key) {
            return known;
        }
        let value = self.push_constant(shape, Numbers::Floats(numbers.to_vec()));
        self.shared.insert(key, value);
        value
    }

    /// Adds a list of integers as a constant; equal ones are stored once.
    pub(crate) fn integers(&mut self, numbers: &[i64]) -> Value {
        if let Some(&known) = self.shared_integers.get(numbers) {
            return known;
        }
        let value = self.push_constant(&[numbers.len()], Numbers::Integers(numbers.to_vec()));
        self.shared_integers.insert(numbers.to_vec(), value);
        value
    }

    fn push_constant(&mut self, shape: &[usize], data: Numbers) -> Value {
        let value = self.named(format!("{}/constant_{}", self.scope, self.names.len()));
        self.constants.push(Constant {
            value,
            shape: shape.to_vec(),
            data,
        });
        value
    }

    /// Adds a node with one output.
    fn node(
        &mut self,
        operation: &'static str,
        inputs: &[Value],
        attributes: &[(&'static str, Attribute)],
    ) -> Value {
        let output = self.named(format!("{}/{operation}_{}", self.scope, self.names.len()));
        self.nodes.push(Node {
            operation,
            inputs: inputs.to_vec(),
            output,
            attributes: attributes.to_vec(),
        });
        output
    }

    fn named(&mut self, name: String) -> Value {
        self.names.push(name);
        Value(self.names.len() - 1)
    }
}

#[cfg(test)]
impl Graph {
    /// Checks that names are unique and that nodes follow what they read.
    pub(crate) fn check_order(&self) {
        let names: std::collections::HashSet<&String> = self.names.iter().collect();
        assert_eq!(names.len(), self.names.len(), "names of {}", self.name);
        let inputs = self.inputs.iter().map(|(_, name)| name);
        let constants = self.constants.iter().map(|c| &self.names[c.value.0]);
        let mut known: std::collections::HashSet<&String> = inputs.chain(constants).collect();
        for node in &self.nodes {
            for input in &node.inputs {
                let name = &self.names[input.0];
                assert!(known.contains(name), "{name} in {}", self.name);
            }
            known.insert(&self.names[node.output.0]);
        }
        for (_, name) in &self.outputs {
            assert!(known.contains(name), "{name} in {}", self.name);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_models;

    #[test]
    fn equal_constants_are_stored_once() {
        let model = test_models::displacement(|_| ());
        let mut graph = Graph::new("test", crate::tick::sizes(&model));
        let one = graph.constant(&[2], &[1.0, 2.0]);
        assert_eq!(graph.constant(&[2], &[1.0, 2.0]), one);
        assert_ne!(graph.constant(&[1, 2], &[1.0, 2.0]), one);
        // Equal as numbers, but not as bits.
        assert_ne!(graph.scalar(0.0), graph.scalar(-0.0));
        assert_eq!(graph.integers(&[1, 2]), graph.integers(&[1, 2]));
    }

    #[test]
    fn a_file_begins_with_version_and_producer_and_ends_with_the_opset() {
        let model = test_models::displacement(|_| ());
        let mut graph = Graph::new("test", crate::tick::sizes(&model));
        let root = graph.input(crate::port::ROOT);
        let twice = graph.scale(root, 2.0);
        graph.output(crate::port::WIND, twice);
        let bytes = graph.to_bytes();
        assert_eq!(bytes[..8], [0x08, 7, 0x12, 4, b'u', b'n', b'i', b'c']);
        assert_eq!(bytes[bytes.len() - 6..], [0x42, 4, 0x0a, 0, 0x10, 13]);
        for text in ["Mul", "Identity", "root", "wind", "test/Mul_2"] {
            assert!(
                bytes.windows(text.len()).any(|window| window == text.as_bytes()),
                "{text}"
            );
        }
    }
}
