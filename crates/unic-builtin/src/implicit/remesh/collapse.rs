//! Collapse of edges that are too short.

use super::{EdgeFaces, LONG, Remeshing, SHORT, normal};
use glam::Vec3;

impl Remeshing<'_> {
    /// Collapses short edges in one pass and returns their number.
    pub(super) fn collapse(&mut self) -> usize {
        let mut count = 0;
        // The list of edges is from before the pass. Length and existence are checked again,
        // because earlier collapses change both.
        for [a, b] in self.edges() {
            if self.relative_length(a, b) >= SHORT {
                continue;
            }
            let Some(edge) = self.faces_on(a, b) else {
                continue;
            };
            // Either end may be removed, if its curves allow it.
            for (gone, kept) in [(a, b), (b, a)] {
                if self.may_collapse(gone, kept, edge) {
                    self.collapse_edge(gone, kept, edge);
                    count += 1;
                    break;
                }
            }
        }
        count
    }

    /// Returns true if removing the vertex `gone` keeps the curves, the topology and the shape.
    fn may_collapse(&self, gone: u32, kept: u32, edge: EdgeFaces) -> bool {
        // A vertex on a single curve may be removed along this curve, a corner never.
        let (gone_bits, kept_bits) = (self.bits[gone as usize], self.bits[kept as usize]);
        let slides = self.is_curve(edge) && gone_bits.count_ones() == 1 && gone_bits & kept_bits != 0;
        if gone_bits != 0 && !slides {
            return false;
        }
        let faces = 1 + usize::from(edge.second.is_some());
        let (of_gone, of_kept) = (self.neighbours(gone), self.neighbours(kept));
        let common = of_gone.iter().filter(|v| of_kept.contains(v)).count();
        // Link condition: more common neighbours than faces would pinch the surface.
        common == faces
            && of_gone.len() > 2
            && of_gone.iter().all(|&v| self.stays_short(v, kept))
            && self.stays_unfolded(gone, kept)
    }

    /// Returns true if the edge from `v` to `kept` would not have to be split again.
    fn stays_short(&self, v: u32, kept: u32) -> bool {
        v == kept || self.relative_length(v, kept) < LONG
    }

    /// Returns true if the collapse turns no face around `gone` by more than about 45 degrees.
    ///
    /// The normals of slivers, which cuts leave behind, are unreliable. Slivers are compared with
    /// the mean normal around the edge instead.
    fn stays_unfolded(&self, gone: u32, kept: u32) -> bool {
        let around = self.around[gone as usize]
            .iter()
            .chain(&self.around[kept as usize]);
        let corners = |f: &u32| self.faces[*f as usize].map(|v| self.at(v));
        let mean: Vec3 = around.map(|f| normal(corners(f))).sum();
        self.around[gone as usize].iter().all(|f| {
            let face = self.faces[*f as usize];
            if face.contains(&kept) {
                return true;
            }
            let [a, b, c] = corners(f);
            let before = normal([a, b, c]);
            let after = normal(face.map(|v| self.at(if v == gone { kept } else { v })));
            let longest = (b - a)
                .length_squared()
                .max((c - b).length_squared())
                .max((a - c).length_squared());
            let is_sliver = before.length() < 0.2 * longest;
            // Cosines of 66 and 45 degrees. The product form avoids dividing by a length of zero.
            let (reference, least) = if is_sliver { (mean, 0.4) } else { (before, 0.7) };
            after.length() > 0.0 && reference.dot(after) > least * reference.length() * after.length()
        })
    }

    fn collapse_edge(&mut self, gone: u32, kept: u32, edge: EdgeFaces) {
        for face in [Some(edge.first), edge.second].into_iter().flatten() {
            for v in self.faces[face as usize] {
                self.around[v as usize].retain(|&f| f != face);
            }
            self.faces[face as usize] = [kept; 3];
        }
        // Both faces of the edge have left the list by now.
        for face in std::mem::take(&mut self.around[gone as usize]) {
            let corners = &mut self.faces[face as usize];
            *corners = corners.map(|v| if v == gone { kept } else { v });
            self.around[kept as usize].push(face);
        }
    }
}
