//! Pairs of a vertex and a face, and those of the previous interval.

/// A vertex that is kept on one side of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ContactPair {
    pub(super) vertex: u32,
    pub(super) face: u32,
    /// Side of the face that the vertex belongs on: 1 in front of it, −1 behind it.
    pub(super) side: f32,
    /// Distance to keep, metres.
    pub(super) thickness_m: f32,
    /// True when the vertex projects into the face. Only then is the side certain.
    pub(super) is_over: bool,
}

/// The pairs of the previous interval, grouped by vertex.
#[derive(Clone, Debug, Default)]
pub(super) struct PreviousPairs {
    /// Row starts of `pairs`: those of vertex i are `pairs[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    pairs: Vec<ContactPair>,
}

impl PreviousPairs {
    /// Takes the pairs and groups them by vertex with a counting sort. Leaves `all` empty.
    pub(super) fn take(&mut self, all: &mut Vec<ContactPair>, vertex_count: usize) {
        self.starts.clear();
        self.starts.resize(vertex_count + 1, 0);
        all.iter().for_each(|pair| self.starts[pair.vertex as usize] += 1);
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        self.pairs.clear();
        // The values only give the list its length: the loop below writes every entry.
        self.pairs
            .extend(all.first().iter().cycle().take(all.len()).copied());
        // Backwards, so that the pairs of a vertex keep their order.
        for pair in all.iter().rev() {
            let start = &mut self.starts[pair.vertex as usize];
            *start -= 1;
            self.pairs[*start as usize] = *pair;
        }
        all.clear();
    }

    /// Returns the pairs of a vertex.
    #[inline]
    pub(super) fn of(&self, vertex: u32) -> &[ContactPair] {
        let row = self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize;
        &self.pairs[row]
    }
}
