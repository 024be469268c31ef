//! ONNX's operations as methods, under the names that formulas have.
//!
//! Shapes in comments follow the arguments: N rows, and lengths that every graph shares.

use super::{
    Attribute::{Int, OneInt},
    Graph, Value,
};
use unic_core::network::Linear;

/// ONNX's number of the element type `FLOAT`.
const FLOAT: i64 = 1;

impl Graph {
    /// Adds a constant of one number, which broadcasts over everything.
    pub(crate) fn scalar(&mut self, number: f32) -> Value {
        self.constant(&[], &[number])
    }

    /// a + b, broadcast.
    pub(crate) fn add(&mut self, a: Value, b: Value) -> Value {
        self.node("Add", &[a, b], &[])
    }

    /// a − b, broadcast.
    pub(crate) fn sub(&mut self, a: Value, b: Value) -> Value {
        self.node("Sub", &[a, b], &[])
    }

    /// Product of elements, broadcast.
    pub(crate) fn mul(&mut self, a: Value, b: Value) -> Value {
        self.node("Mul", &[a, b], &[])
    }

    /// Quotient of elements, broadcast.
    pub(crate) fn div(&mut self, a: Value, b: Value) -> Value {
        self.node("Div", &[a, b], &[])
    }

    /// Product with a number.
    pub(crate) fn scale(&mut self, a: Value, factor: f32) -> Value {
        let factor = self.scalar(factor);
        self.mul(a, factor)
    }

    /// Larger one of each element and a number.
    pub(crate) fn at_least(&mut self, a: Value, number: f32) -> Value {
        let number = self.scalar(number);
        self.node("Max", &[a, number], &[])
    }

    /// Elements between −`limit` and `limit`.
    pub(crate) fn clamp(&mut self, a: Value, limit: f32) -> Value {
        let [low, high] = [-limit, limit].map(|bound| self.scalar(bound));
        self.node("Clip", &[a, low, high], &[])
    }

    /// Function of one argument, element by element, by ONNX's name.
    pub(crate) fn map(&mut self, function: &'static str, a: Value) -> Value {
        self.node(function, &[a], &[])
    }

    /// Truth of a < b, element by element.
    pub(crate) fn less(&mut self, a: Value, b: Value) -> Value {
        self.node("Less", &[a, b], &[])
    }

    /// Truth of a < number, element by element; false for NaN.
    pub(crate) fn is_below(&mut self, a: Value, number: f32) -> Value {
        let number = self.scalar(number);
        self.less(a, number)
    }

    /// `yes` where the condition is true, `no` elsewhere.
    pub(crate) fn choose(&mut self, condition: Value, yes: Value, no: Value) -> Value {
        self.node("Where", &[condition, yes, no], &[])
    }

    /// 1 for true, 0 for false.
    pub(crate) fn zero_or_one(&mut self, condition: Value) -> Value {
        self.node("Cast", &[condition], &[("to", Int(FLOAT))])
    }

    /// Matrix product of the last two axes.
    pub(crate) fn matmul(&mut self, a: Value, b: Value) -> Value {
        self.node("MatMul", &[a, b], &[])
    }

    /// A transposed matrix.
    pub(crate) fn transpose(&mut self, a: Value) -> Value {
        self.node("Transpose", &[a], &[])
    }

    /// x Wᵀ + b of rows x (N, inputs), with W and b in the layout of a [`Linear`]: (N, outputs).
    pub(crate) fn linear(&mut self, x: Value, layer: &Linear) -> Value {
        let weight = self.constant(&[layer.outputs, layer.inputs], &layer.weight);
        let bias = self.constant(&[layer.outputs], &layer.bias);
        self.linear_with(x, weight, bias)
    }

    /// x Wᵀ + b of rows x, with W (outputs, inputs) and b (outputs), (1, outputs) or (N, outputs).
    pub(crate) fn linear_with(&mut self, x: Value, weight: Value, bias: Value) -> Value {
        self.node("Gemm", &[x, weight, bias], &[("transB", Int(1))])
    }

    /// Values side by side along an axis.
    pub(crate) fn concat(&mut self, values: &[Value], axis: i64) -> Value {
        self.node("Concat", values, &[("axis", Int(axis))])
    }

    /// The same numbers in another shape, in which one length may be −1 for the rest.
    pub(crate) fn reshape(&mut self, a: Value, shape: &[i64]) -> Value {
        let shape = self.integers(shape);
        self.node("Reshape", &[a, shape], &[])
    }

    /// Entries at constant indices of an axis.
    pub(crate) fn take(&mut self, a: Value, indices: &[i64], axis: i64) -> Value {
        let indices = self.integers(indices);
        self.take_at(a, indices, axis)
    }

    /// Entries at computed indices of an axis.
    pub(crate) fn take_at(&mut self, a: Value, indices: Value, axis: i64) -> Value {
        self.node("Gather", &[a, indices], &[("axis", Int(axis))])
    }

    /// Entries `start..end` of an axis.
    pub(crate) fn slice(&mut self, a: Value, start: usize, end: usize, axis: i64) -> Value {
        let [start, end] = [start, end].map(|bound| self.integers(&[bound as i64]));
        let axes = self.integers(&[axis]);
        self.node("Slice", &[a, start, end, axes], &[])
    }

    /// Sum over an axis, which stays with length 1.
    pub(crate) fn sum_kept(&mut self, a: Value, axis: i64) -> Value {
        let axes = self.integers(&[axis]);
        self.node("ReduceSum", &[a, axes], &[("keepdims", Int(1))])
    }

    /// Sum over an axis, which is removed.
    pub(crate) fn sum(&mut self, a: Value, axis: i64) -> Value {
        let axes = self.integers(&[axis]);
        self.node("ReduceSum", &[a, axes], &[("keepdims", Int(0))])
    }

    /// Squared lengths of rows (N, C): (N, 1).
    pub(crate) fn squared_lengths(&mut self, rows: Value) -> Value {
        let squares = self.mul(rows, rows);
        self.sum_kept(squares, 1)
    }

    /// Index of the largest element of each row (N, C): (N). Of equal ones the first.
    pub(crate) fn largest(&mut self, rows: Value) -> Value {
        self.node("ArgMax", &[rows], &[("axis", Int(1)), ("keepdims", Int(0))])
    }

    /// Largest element of each row (N, C): (N, 1).
    pub(crate) fn maximum(&mut self, rows: Value) -> Value {
        self.node("ReduceMax", &[rows], &[("axes", OneInt(1))])
    }

    /// Least element of each row (N, C): (N, 1).
    pub(crate) fn minimum(&mut self, rows: Value) -> Value {
        self.node("ReduceMin", &[rows], &[("axes", OneInt(1))])
    }
}
