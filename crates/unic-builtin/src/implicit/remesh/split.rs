//! Split of edges that are too long.

use super::{EdgeFaces, LONG, Remeshing};

impl Remeshing<'_> {
    /// Splits long edges in one pass.
    pub(super) fn split(&mut self) {
        for [a, b] in self.edges() {
            if self.relative_length(a, b) > LONG
                && let Some(edge) = self.faces_on(a, b)
            {
                self.split_edge(a, b, edge);
            }
        }
    }

    fn split_edge(&mut self, a: u32, b: u32, edge: EdgeFaces) {
        // Two vertices of a curve may be joined by an edge through the interior: only the middle of
        // an edge on the curve belongs to the curve.
        let shared = self.bits[a as usize] & self.bits[b as usize];
        let bits = if self.is_curve(edge) { shared } else { 0 };
        let middle = self.surfaces.projected(self.at(a).midpoint(self.at(b)), bits);
        let new = self.vertices.len() as u32;
        self.vertices.push(middle);
        self.wanted.push((self.sizing.edge)(middle));
        self.bits.push(bits);
        self.around.push(Vec::new());
        for face in [Some(edge.first), edge.second].into_iter().flatten() {
            let old = self.faces[face as usize];
            let replaced = |from: u32| old.map(|v| if v == from { new } else { v });
            let second = self.faces.len() as u32;
            let opposite = self.opposite(face, a, b);
            // The old face keeps a; the new one takes b.
            self.faces[face as usize] = replaced(b);
            self.faces.push(replaced(a));
            self.labels.push(self.labels[face as usize]);
            self.around[b as usize].retain(|&f| f != face);
            self.around[b as usize].push(second);
            self.around[opposite as usize].push(second);
            self.around[new as usize].extend([face, second]);
        }
    }
}
