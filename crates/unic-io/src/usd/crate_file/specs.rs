//! Prims and properties of a layer, as a tree.

/// Kind of a spec, by its number in the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SpecKind {
    Attribute = 1,
    Prim = 6,
    /// The layer itself.
    Layer = 7,
}

/// A layer, prim or attribute with its fields.
#[derive(Clone, Debug)]
pub(super) struct Spec {
    /// Token of its name.
    pub(super) name: u32,
    pub(super) kind: SpecKind,
    /// Index of the first field of its set.
    pub(super) fields: u32,
    pub(super) children: Vec<Spec>,
}

/// Numbers that say how the tree goes on behind a path.
mod jump {
    pub(super) const SIBLING_ONLY: i32 = 0;
    pub(super) const CHILD_ONLY: i32 = -1;
    pub(super) const NEITHER: i32 = -2;
}

/// Paths of a tree, in the order of [`Spec::iter`].
#[derive(Clone, Debug, Default)]
pub(super) struct Paths {
    /// Token of the last part of each path; negative for properties.
    pub(super) parts: Vec<i32>,
    /// Distance to the next sibling of a path that also has a child, or one of [`jump`].
    pub(super) jumps: Vec<i32>,
}

impl Spec {
    /// Number of specs of the tree.
    pub(super) fn count(&self) -> usize {
        1 + self.children.iter().map(Spec::count).sum::<usize>()
    }

    /// Iterates over the tree, parents before their children: the order of paths.
    pub(super) fn iter(&self) -> Box<dyn Iterator<Item = &Spec> + '_> {
        Box::new(std::iter::once(self).chain(self.children.iter().flat_map(Spec::iter)))
    }

    /// Returns the paths of the tree.
    pub(super) fn paths(&self) -> Paths {
        let mut paths = Paths::default();
        self.push_paths(&mut paths, false);
        paths
    }

    fn push_paths(&self, paths: &mut Paths, has_sibling: bool) {
        let name = self.name as i32;
        paths.parts.push(match self.kind {
            // Token 0 is the empty one, so that no property has it.
            SpecKind::Attribute => -name,
            SpecKind::Prim | SpecKind::Layer => name,
        });
        paths.jumps.push(match (self.children.is_empty(), has_sibling) {
            (false, true) => self.count() as i32,
            (false, false) => jump::CHILD_ONLY,
            (true, true) => jump::SIBLING_ONLY,
            (true, false) => jump::NEITHER,
        });
        for (i, child) in self.children.iter().enumerate() {
            child.push_paths(paths, i + 1 < self.children.len());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jumps_lead_over_the_children_to_the_sibling() {
        let spec = |name, kind, children| Spec {
            name,
            kind,
            fields: 0,
            children,
        };
        let attribute = |name| spec(name, SpecKind::Attribute, Vec::new());
        let mesh = |name| spec(name, SpecKind::Prim, vec![attribute(8), attribute(9)]);
        let root = spec(0, SpecKind::Layer, vec![mesh(1), mesh(2)]);
        let paths = root.paths();
        assert_eq!(paths.parts, [0, 1, -8, -9, 2, -8, -9]);
        assert_eq!(paths.jumps, [-1, 3, 0, -2, -1, 0, -2]);
        assert_eq!(root.iter().count(), root.count());
    }
}
