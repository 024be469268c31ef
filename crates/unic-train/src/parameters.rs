//! Values of a network's parameters, in the order in which Burn visits them.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{Tensor, TensorData};

/// Copies every parameter to the host, each row-major.
pub(crate) fn values<N: Module>(network: &N) -> Vec<Vec<f32>> {
    let mut collected = Collected(Vec::new());
    network.visit(&mut collected);
    collected.0
}

/// Replaces every parameter's values, on the device that it is on. The numbers of elements must be
/// those of [`values`].
pub(crate) fn replaced<N: Module>(network: N, values: &[Vec<f32>]) -> N {
    network.map(&mut Replacing {
        values: values.iter(),
    })
}

struct Collected(Vec<Vec<f32>>);

impl ModuleVisitor for Collected {
    fn visit_float<const D: usize>(&mut self, parameter: &Param<Tensor<D>>) {
        let values = parameter.val().inner().try_into_vec_as::<f32>();
        // Every parameter of this crate is made as f32 and never changes its type.
        self.0.push(values.expect("f32 parameters"));
    }
}

struct Replacing<'a> {
    values: std::slice::Iter<'a, Vec<f32>>,
}

impl ModuleMapper for Replacing<'_> {
    fn map_float<const D: usize>(&mut self, parameter: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (id, tensor, mapper) = parameter.consume();
        let values = self.values.next().cloned().unwrap_or_default();
        let data = TensorData::new(values, tensor.dims());
        let tensor = Tensor::<D>::from_data(data, &tensor.device()).require_grad();
        Param::from_mapped_value(id, tensor, mapper)
    }
}
