//! Damped oscillators over time, as one differentiable operation.
//!
//! On the CPU it is a loop over the frames, forward and backward. Elsewhere it is [`composed`] of
//! Burn's operations, which are also what the loop is tested against.

use crate::{
    device::is_on_cpu,
    field_op::{cpu, primitive, slice},
};
use burn::backend::autodiff::{
    checkpoint::{base::Checkpointer, strategy::NoCheckpointing},
    grads::Gradients as Registry,
    ops::{Backward, Ops, OpsKind},
};
use burn::backend::{Autodiff, Flex, tensor::FloatTensor};
use burn::tensor::Tensor;

/// States h of damped oscillators: h_0 = `first`, h_t = λ h_{t−1} + u_t.
///
/// `first` is `[windows, 2 M]`. u is the `drive` `[frames, windows, 2 M]`, whose frame 0 is not
/// read. λ are the `poles` `[2 M]`. The result is `[frames, windows, 2 M]`. All have real parts
/// before imaginary ones. Gradients flow to all three arguments.
///
/// # Panics
/// Panics if sizes do not fit, and without a frame.
pub(super) fn oscillations(poles: Tensor<1>, first: Tensor<2>, drive: Tensor<3>) -> Tensor<3> {
    let [frames, windows, state] = drive.dims();
    assert!(
        frames > 0 && state > 0 && state.is_multiple_of(2),
        "{:?}",
        drive.dims()
    );
    assert_eq!((poles.dims(), first.dims()), ([state], [windows, state]));
    match is_on_cpu(&drive) {
        true => looped(poles, first, drive),
        false => composed(poles, first, drive),
    }
}

/// States by doubling: sums over d frames are combined to sums over 2 d frames.
fn composed(poles: Tensor<1>, first: Tensor<2>, drive: Tensor<3>) -> Tensor<3> {
    let [frames, _, state] = drive.dims();
    let count = state / 2;
    let first: Tensor<3> = first.unsqueeze();
    let all = match frames {
        1 => first,
        _ => Tensor::cat(vec![first, drive.narrow(0, 1, frames - 1)], 0),
    };
    let mut h = [0, count].map(|part| all.clone().narrow(2, part, count));
    let mut power: [Tensor<3>; 2] = [0, count].map(|part| poles.clone().narrow(0, part, count).unsqueeze());
    let mut ticks = 1;
    while ticks < frames {
        let earlier = h.clone().map(|x| later(x, ticks));
        let [re, im] = times(earlier, power.clone());
        let [h_re, h_im] = h;
        h = [h_re + re, h_im + im];
        // `power` is λ to the power of `ticks`, so both double together.
        power = times(power.clone(), power);
        ticks *= 2;
    }
    Tensor::cat(h.into(), 2)
}

/// Product of complex numbers.
fn times([a, b]: [Tensor<3>; 2], [c, d]: [Tensor<3>; 2]) -> [Tensor<3>; 2] {
    [a.clone() * c.clone() - b.clone() * d.clone(), a * d + b * c]
}

/// Shifts a series by `ticks` frames; the first ones become zero.
fn later(x: Tensor<3>, ticks: usize) -> Tensor<3> {
    let [frames, ..] = x.dims();
    let kept = x.clone().narrow(0, 0, frames - ticks);
    let zeros = x.narrow(0, 0, ticks).zeros_like();
    Tensor::cat(vec![zeros, kept], 0)
}

fn looped(poles: Tensor<1>, first: Tensor<2>, drive: Tensor<3>) -> Tensor<3> {
    let sizes = drive.dims();
    let (poles, poles_node) = cpu(poles.autodiff()).into_parts();
    let (first, first_node) = cpu(first.autodiff()).into_parts();
    let (drive, drive_node) = cpu(drive.autodiff()).into_parts();
    let [poles, first, drive] = [poles, first, drive].map(|tensor| tensor.to_contiguous());
    let states = Loop::of(&poles, sizes).forward(slice(&first), slice(&drive));
    let states = primitive(states, sizes);
    let nodes = [poles_node, first_node, drive_node];
    let tensor = match Oscillations
        .prepare::<NoCheckpointing>(nodes)
        .compute_bound()
        .stateful()
    {
        OpsKind::Tracked(prepared) => {
            let state = (poles, states.clone(), sizes);
            prepared.finish(state, states)
        }
        OpsKind::UnTracked(prepared) => prepared.finish(states),
    };
    Tensor::from_primitive::<Autodiff<Flex>>(tensor)
}

#[derive(Debug)]
struct Oscillations;

impl Backward<Flex, 3> for Oscillations {
    /// Poles, output states, and the sizes of the states.
    type State = (FloatTensor<Flex>, FloatTensor<Flex>, [usize; 3]);

    fn backward(self, ops: Ops<Self::State, 3>, registry: &mut Registry, _: &mut Checkpointer) {
        let upstream = registry.consume::<Flex>(&ops.node).to_contiguous();
        let (poles, states, sizes) = ops.state;
        let [frames, windows, state] = sizes;
        let backward = Loop::of(&poles, sizes).backward(slice(&states), slice(&upstream));
        let shapes = [vec![state], vec![windows, state], vec![frames, windows, state]];
        for ((node, shape), values) in ops.parents.into_iter().zip(shapes).zip(backward) {
            if let Some(node) = node {
                registry.register::<Flex>(node.id, primitive(values, shape));
            }
        }
    }
}

/// The recursion over plain numbers.
struct Loop<'a> {
    /// Real and imaginary parts of λ.
    poles: [&'a [f32]; 2],
    /// Numbers of a frame: windows × 2 M.
    frame: usize,
    frames: usize,
}

impl<'a> Loop<'a> {
    fn of(poles: &'a FloatTensor<Flex>, [frames, windows, state]: [usize; 3]) -> Self {
        Self {
            poles: slice(poles).split_at(state / 2).into(),
            frame: windows * state,
            frames,
        }
    }

    /// Computes the states h of all frames.
    fn forward(&self, first: &[f32], drive: &[f32]) -> Vec<f32> {
        let mut states = drive.to_vec();
        // The first state takes the place of the drive's frame 0.
        states[..self.frame].copy_from_slice(first);
        for t in 1..self.frames {
            let (before, now) = states.split_at_mut(t * self.frame);
            self.add_turned(self.poles, &before[(t - 1) * self.frame..], now);
        }
        states
    }

    /// Computes the gradients to poles, first state and drive from the states and their gradients.
    ///
    /// The adjoint a_t = g_t + λ̄ a_{t+1} is that of u_t, and that of λ is Σ h̄_{t−1} a_t.
    fn backward(&self, states: &[f32], upstream: &[f32]) -> [Vec<f32>; 3] {
        let mut adjoint = upstream.to_vec();
        let [re, im] = self.poles;
        let conjugate: Vec<f32> = im.iter().map(|im| -im).collect();
        for t in (1..self.frames).rev() {
            let (before, now) = adjoint.split_at_mut(t * self.frame);
            self.add_turned([re, &conjugate], now, &mut before[(t - 1) * self.frame..]);
        }
        let count = re.len();
        let mut to_poles = vec![0.0f32; 2 * count];
        let (to_re, to_im) = to_poles.split_at_mut(count);
        let rows = states.chunks_exact(2 * count);
        let later = adjoint[self.frame..].chunks_exact(2 * count);
        for (h, a) in rows.zip(later) {
            let ((h_re, h_im), (a_re, a_im)) = (h.split_at(count), a.split_at(count));
            for k in 0..count {
                to_re[k] += a_re[k] * h_re[k] + a_im[k] * h_im[k];
                to_im[k] += a_im[k] * h_re[k] - a_re[k] * h_im[k];
            }
        }
        let first = adjoint[..self.frame].to_vec();
        // Frame 0 of the drive is not read, so its gradient is zero.
        adjoint[..self.frame].fill(0.0);
        [to_poles, first, adjoint]
    }

    /// Adds a frame, multiplied by one complex number per oscillator, to another frame.
    fn add_turned(&self, [re, im]: [&[f32]; 2], from: &[f32], to: &mut [f32]) {
        let count = re.len();
        let rows = from[..self.frame].chunks_exact(2 * count);
        for (from, to) in rows.zip(to.chunks_exact_mut(2 * count)) {
            let ((x, y), (to_x, to_y)) = (from.split_at(count), to.split_at_mut(count));
            for k in 0..count {
                to_x[k] += re[k] * x[k] - im[k] * y[k];
                to_y[k] += re[k] * y[k] + im[k] * x[k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        noise::normal,
        stream::{Stream, generator},
    };
    use burn::tensor::{Device, TensorData};

    const WINDOWS: usize = 3;
    const COUNT: usize = 5;

    /// Values and gradients to poles, first and drive, in a sum of the states with random weights.
    fn differentiated(
        frames: usize,
        operation: fn(Tensor<1>, Tensor<2>, Tensor<3>) -> Tensor<3>,
    ) -> [Vec<f32>; 4] {
        let device = Device::flex().autodiff();
        let mut rng = generator(5, Stream::Recurrence, 0);
        let mut random = |count: usize| -> Vec<f32> { (0..count).map(|_| normal(&mut rng)).collect() };
        let poles = random(2 * COUNT)
            .iter()
            .map(|x| 0.9 * (x.tanh() / 2f32.sqrt()))
            .collect();
        let sizes = [frames, WINDOWS, 2 * COUNT];
        let tensor = |values: Vec<f32>, shape: &[usize]| TensorData::new(values, shape.to_vec());
        let poles = Tensor::<1>::from_data(tensor(poles, &sizes[2..]), &device).require_grad();
        let first = random(sizes[1] * sizes[2]);
        let first = Tensor::<2>::from_data(tensor(first, &sizes[1..]), &device).require_grad();
        let drive = random(sizes.iter().product());
        let drive = Tensor::<3>::from_data(tensor(drive, &sizes), &device).require_grad();
        let weights = Tensor::<3>::from_data(tensor(random(sizes.iter().product()), &sizes), &device);
        let states = operation(poles.clone(), first.clone(), drive.clone());
        let gradients = (states.clone() * weights).sum().backward();
        let values = |data: TensorData| data.try_to_vec::<f32>().unwrap();
        // Where frame 0 is all that there is, the poles and the drive are not part of the other
        // graph.
        let zeros = |count: usize| vec![0.0; count];
        [
            values(states.into_data()),
            poles
                .grad(&gradients)
                .map_or(zeros(sizes[2]), |g| values(g.into_data())),
            values(first.grad(&gradients).unwrap().into_data()),
            (drive.grad(&gradients)).map_or(zeros(sizes.iter().product()), |g| values(g.into_data())),
        ]
    }

    #[test]
    fn looped_and_composed_oscillations_agree_in_values_and_gradients() {
        for frames in [1, 2, 3, 8, 33] {
            let [looped, composed] = [looped, composed].map(|operation| differentiated(frames, operation));
            for (name, (a, b)) in ["states", "poles", "first", "drive"]
                .iter()
                .zip(looped.iter().zip(&composed))
            {
                assert_eq!(a.len(), b.len(), "{name}");
                let size = b.iter().fold(1e-3f32, |most, x| most.max(x.abs()));
                for (a, b) in a.iter().zip(b) {
                    assert!((a - b).abs() < 1e-5 * size, "{frames} frames, {name}: {a} {b}");
                }
            }
        }
    }
}
