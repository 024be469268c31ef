//! Adjacency of a garment's vertices, with seams closed.

use crate::{
    aabb_tree::LANES,
    intersection::packets::Packets,
    mesh::TriMesh,
    topology::{edges, weld},
};
use glam::Vec3;

/// Adjacency of a garment's vertices by slot. The vertices of a seam at the same place are welded:
/// one slot stands for all of them.
#[derive(Clone, Debug)]
pub(super) struct Neighbours {
    /// Slot that stands for each slot.
    welded_slots: Vec<u32>,
    /// Welded slots across the edges of each welded slot.
    around: CompressedRows,
    /// Packets around each packet: itself, those across edges of its slots, and those of their
    /// welded slots.
    around_packet: CompressedRows,
}

/// Lists of numbers, concatenated.
#[derive(Clone, Debug)]
pub(super) struct CompressedRows {
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Neighbours {
    pub(super) fn new(rest: &TriMesh, packets: &Packets) -> Self {
        let slots = packets.slots();
        let welded_vertices = weld(&rest.vertices);
        let mut welded_slots: Vec<u32> = (0..packets.len() as u32).collect();
        for (vertex, &first) in welded_vertices.iter().enumerate() {
            welded_slots[slots[vertex] as usize] = slots[first as usize];
        }
        let welded: Vec<_> = (rest.faces.iter())
            .map(|f| f.map(|v| slots[welded_vertices[v as usize] as usize]))
            .collect();
        let directed: Vec<[u32; 2]> = (edges(&welded).into_iter())
            .flat_map(|[a, b]| [[a, b], [b, a]])
            .collect();
        let packet = |slot: u32| slot / LANES as u32;
        // A packet also depends on the packets of its welded slots, which hold its displacements.
        let count = packets.len().div_ceil(LANES);
        let own = (0..packets.len() as u32).zip(&welded_slots);
        let own = own.map(|(slot, &welded)| [slot, welded]);
        let between = directed.iter().copied().chain(own);
        let between = between.map(|pair| pair.map(packet)).collect();
        Self {
            welded_slots,
            around_packet: CompressedRows::new(count, between),
            around: CompressedRows::new(packets.len(), directed),
        }
    }

    /// Slot that stands for all slots at the same place.
    #[inline(always)]
    pub(super) fn welded_slot(&self, slot: usize) -> usize {
        self.welded_slots[slot] as usize
    }

    /// Packets that hold the welded slots, or the neighbours, of a packet's slots.
    pub(super) fn of_packet(&self, packet: usize) -> &[u32] {
        self.around_packet.row(packet)
    }

    /// Welded slots across the edges of a welded slot.
    pub(super) fn of_slot(&self, slot: usize) -> &[u32] {
        self.around.row(slot)
    }

    /// Mean of a value over the neighbours of a welded slot; zero without neighbours.
    pub(super) fn mean(&self, slot: usize, values: &[Vec3]) -> Vec3 {
        let around = self.around.row(slot);
        let sum: Vec3 = around.iter().map(|&i| values[i as usize]).sum();
        // Neighbours are sorted, so the sum has the same order on every run.
        sum / around.len().max(1) as f32
    }
}

impl CompressedRows {
    /// Makes rows from pairs of a row and an entry, in any order. Entries are sorted, each once.
    pub(super) fn new(rows: usize, mut pairs: Vec<[u32; 2]>) -> Self {
        pairs.sort_unstable();
        pairs.dedup();
        let count = |row: u32| pairs.partition_point(|&[r, _]| r < row) as u32;
        Self {
            starts: (0..=rows as u32).map(count).collect(),
            entries: pairs.iter().map(|&[_, entry]| entry).collect(),
        }
    }

    pub(super) fn row(&self, row: usize) -> &[u32] {
        &self.entries[self.starts[row] as usize..self.starts[row + 1] as usize]
    }
}
