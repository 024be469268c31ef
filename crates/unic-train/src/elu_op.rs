//! ELU as one differentiable operation. On the CPU it takes one pass over memory forward and one
//! backward, where Burn's operations take a dozen.

use crate::{
    device::is_on_cpu,
    field_op::{cpu, primitive, slice},
};
use burn::backend::autodiff::{
    checkpoint::{base::Checkpointer, strategy::NoCheckpointing},
    grads::Gradients as Registry,
    ops::{Backward, Ops, OpsKind},
};
use burn::backend::{Autodiff, Flex, TensorMetadata, tensor::FloatTensor};
use burn::tensor::{Tensor, activation};

/// x where it is positive, eˣ − 1 elsewhere.
pub(crate) fn elu<const D: usize>(x: Tensor<D>) -> Tensor<D> {
    match is_on_cpu(&x) {
        true => in_one_pass(x),
        false => composed(x),
    }
}

/// ELU of Burn's operations, on any device. Burn's own ELU takes exp of positive inputs too, whose
/// gradient is 0 · ∞ = NaN above 88.
fn composed<const D: usize>(x: Tensor<D>) -> Tensor<D> {
    activation::relu(x.clone()) + (x.clamp_max(0.0).exp() - 1.0)
}

fn in_one_pass<const D: usize>(x: Tensor<D>) -> Tensor<D> {
    let (x, node) = cpu(x.autodiff()).into_parts();
    // A transposed tensor does not store its values in row-major order.
    let x = x.to_contiguous();
    let of = |x: &f32| if *x > 0.0 { *x } else { x.exp() - 1.0 };
    let y = primitive(slice(&x).iter().map(of).collect(), x.shape());
    let tensor = match Elu.prepare::<NoCheckpointing>([node]).compute_bound().stateful() {
        OpsKind::Tracked(prepared) => prepared.finish(y.clone(), y),
        OpsKind::UnTracked(prepared) => prepared.finish(y),
    };
    Tensor::from_primitive::<Autodiff<Flex>>(tensor)
}

#[derive(Debug)]
struct Elu;

impl Backward<Flex, 1> for Elu {
    /// Output y. Its slope is 1 where y is above zero, and y + 1 elsewhere.
    type State = FloatTensor<Flex>;

    fn backward(self, ops: Ops<Self::State, 1>, registry: &mut Registry, _: &mut Checkpointer) {
        let upstream = registry.consume::<Flex>(&ops.node).to_contiguous();
        let [Some(parent)] = ops.parents else {
            return;
        };
        let pairs = slice(&upstream).iter().zip(slice(&ops.state));
        // For negative x, y + 1 = eˣ: the slope needs no second exponential.
        let values = pairs.map(|(g, y)| g * (y.min(0.0) + 1.0)).collect();
        registry.register::<Flex>(parent.id, primitive(values, ops.state.shape()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use burn::tensor::{Device, TensorData};

    #[test]
    fn fused_and_composed_elu_agree_in_values_and_gradients() {
        let device = Device::flex().autodiff();
        let ends = [-200.0, 200.0].into_iter();
        let values: Vec<f32> = (-40..=40).map(|i| i as f32 / 8.0).chain(ends).collect();
        let results = [in_one_pass, composed].map(|operation: fn(Tensor<1>) -> Tensor<1>| {
            let x = TensorData::new(values.clone(), [values.len()]);
            let x = Tensor::<1>::from_data(x, &device).require_grad();
            let y = operation(x.clone());
            let gradients = (y.clone() * y.clone()).sum().backward();
            let values = |tensor: TensorData| tensor.try_to_vec::<f32>().unwrap();
            [
                values(y.into_data()),
                values(x.grad(&gradients).unwrap().into_data()),
            ]
        });
        let [one, other] = results.map(|of| of.concat());
        for (a, b) in one.iter().zip(&other) {
            assert!((a - b).abs() < 1e-6 * (1.0 + b.abs()), "{a} {b}");
        }
    }

    #[test]
    fn values_and_slopes_are_known_and_finite_everywhere() {
        let device = Device::flex().autodiff();
        let x = Tensor::<2>::from_data([[-200.0f32, 0.5], [-1.0, 200.0]], &device);
        let (slope, of) = ((-1.0f32).exp(), |data: TensorData| {
            data.try_to_vec::<f32>().unwrap()
        });
        // Transposed, so that its numbers do not lie in their order.
        let plain = of(elu(x.clone().transpose()).into_data());
        let x = x.require_grad();
        let y = elu(x.clone().transpose());
        let gradients = y.clone().sum().backward();
        let known = |found: Vec<f32>, known: [f32; 4]| {
            let gaps = found.iter().zip(known).map(|(a, b)| (a - b).abs());
            assert!(gaps.fold(0.0, f32::max) < 1e-6, "{found:?}");
        };
        known(plain, [-1.0, slope - 1.0, 0.5, 200.0]);
        known(of(y.into_data()), [-1.0, slope - 1.0, 0.5, 200.0]);
        known(
            of(x.grad(&gradients).unwrap().into_data()),
            [0.0, 1.0, slope, 1.0],
        );
    }
}
