//! Properties of objects.

use super::{data_type::DataType, metadata::Metadata};
use crate::container::Group;

/// Property of an object: named values over time, or a group of properties.
#[derive(Clone, Debug)]
pub struct Property {
    /// Name, unique among its neighbours in valid files.
    pub name: Box<str>,
    /// Metadata, such as the meaning of the numbers.
    pub metadata: Metadata,
    /// Values or properties.
    pub content: Content,
}

/// Content of a property.
#[derive(Clone, Debug)]
pub enum Content {
    /// Further properties.
    Compound(Box<[Property]>),
    /// Values over time.
    Samples(Samples),
}

impl Property {
    /// Samples, if the property is no compound.
    pub fn samples(&self) -> Option<&Samples> {
        match &self.content {
            Content::Samples(samples) => Some(samples),
            Content::Compound(_) => None,
        }
    }

    /// Properties of a compound; none of others.
    pub fn properties(&self) -> &[Property] {
        match &self.content {
            Content::Compound(properties) => properties,
            Content::Samples(_) => &[],
        }
    }
}

/// Number of elements of each sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleLayout {
    /// One element.
    Scalar,
    /// Any number of elements, which may differ between samples.
    Array,
}

/// Samples of a property: their type, number and place in the file.
///
/// [`Archive::read`](super::Archive::read) reads them one at a time.
#[derive(Clone, Copy, Debug)]
pub struct Samples {
    pub(crate) group: Group,
    pub(crate) layout: SampleLayout,
    pub(crate) data_type: DataType,
    pub(crate) count: u32,
    pub(crate) changes: Changes,
    pub(crate) sampling: u32,
}

/// First and last index whose sample differs from the one before; none if all samples are equal.
pub(crate) type Changes = Option<(u32, u32)>;

impl Samples {
    /// Whether a sample is one element or an array.
    pub fn layout(&self) -> SampleLayout {
        self.layout
    }

    /// Type of the elements.
    pub fn data_type(&self) -> DataType {
        self.data_type
    }

    /// Number of samples. A broken file may claim up to 2³² - 1 equal ones.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Whether all samples are equal.
    pub fn is_constant(&self) -> bool {
        self.changes.is_none()
    }

    /// Index of the time sampling in [`Archive::time_samplings`](super::Archive::time_samplings).
    pub fn sampling(&self) -> u32 {
        self.sampling
    }

    /// Number of samples in the file.
    pub(crate) fn stored(&self) -> u64 {
        match self.changes {
            None => u64::from(self.count.min(1)),
            Some((first, last)) => u64::from(last) - u64::from(first) + 2,
        }
    }

    /// Index of a sample among the stored ones: those before the first change are equal to sample 0,
    /// those behind the last change to the last one.
    pub(crate) fn stored_index(&self, index: u32) -> u64 {
        match self.changes {
            Some((first, last)) if index >= first => u64::from(index.min(last) - first) + 1,
            _ => 0,
        }
    }

    /// Index of the data of a sample among the children of the group.
    pub(crate) fn child(&self, index: u32) -> u64 {
        self.stored_index(index) * self.children_per_sample()
    }

    /// An array has a second child for its dimensions.
    pub(crate) fn children_per_sample(&self) -> u64 {
        match self.layout {
            SampleLayout::Scalar => 1,
            SampleLayout::Array => 2,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::archive::Pod;

    fn samples(count: u32, changes: Changes) -> Samples {
        Samples {
            group: Group::default(),
            layout: SampleLayout::Array,
            data_type: DataType::new(Pod::F32, 3),
            count,
            changes,
            sampling: 0,
        }
    }

    #[test]
    fn repeated_samples_share_a_stored_one() {
        // Samples a a a b c c d d d: changes from 3 to 6.
        let some = samples(9, Some((3, 6)));
        let stored: Vec<u64> = (0..9).map(|i| some.stored_index(i)).collect();
        assert_eq!(stored, [0, 0, 0, 1, 2, 3, 4, 4, 4]);
        assert_eq!((some.stored(), some.child(3)), (5, 2));
        let constant = samples(5, None);
        assert!((0..5).all(|i| constant.stored_index(i) == 0));
        assert_eq!((constant.stored(), samples(0, None).stored()), (1, 0));
    }
}
