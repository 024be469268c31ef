//! Which places of a garment are connected.

use crate::{
    bvh::LANES,
    intersection::packets::Packets,
    mesh::TriMesh,
    topology::{edges, weld},
};
use glam::Vec3;

/// The places of a garment, which may hold several vertices of a seam, and the edges between them, by
/// slot.
#[derive(Clone, Debug)]
pub(super) struct Neighbours {
    /// The slot that stands for the place of each.
    place_of_slot: Vec<u32>,
    around: Rows,
    /// For each packet with places of its own the packets that edges lead to, or that hold a place of one in it,
    /// and itself.
    around_packet: Rows,
}

/// Lists of numbers, one after the other.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Neighbours {
    pub(super) fn new(rest: &TriMesh, packets: &Packets) -> Self {
        let slots = packets.slots();
        let first_at = weld(&rest.vertices);
        let mut place_of_slot: Vec<u32> = (0..packets.len() as u32).collect();
        for (vertex, &first) in first_at.iter().enumerate() {
            place_of_slot[slots[vertex] as usize] = slots[first as usize];
        }
        let welded: Vec<_> = (rest.faces.iter())
            .map(|f| f.map(|v| slots[first_at[v as usize] as usize]))
            .collect();
        let directed: Vec<[u32; 2]> = (edges(&welded).into_iter())
            .flat_map(|[a, b]| [[a, b], [b, a]])
            .collect();
        let packet = |slot: u32| slot / LANES as u32;
        let count = packets.len().div_ceil(LANES);
        let places = (0..packets.len() as u32).zip(&place_of_slot);
        let own = places.map(|(slot, &place)| [slot, place]);
        let between = directed.iter().copied().chain(own);
        let between = between.map(|pair| pair.map(packet)).collect();
        Self {
            place_of_slot,
            around_packet: Rows::new(count, between),
            around: Rows::new(packets.len(), directed),
        }
    }

    #[inline(always)]
    pub(super) fn place(&self, slot: usize) -> usize {
        self.place_of_slot[slot] as usize
    }

    /// Packets with the places or neighbours of what is in a packet.
    pub(super) fn of_packet(&self, packet: usize) -> &[u32] {
        self.around_packet.row(packet)
    }

    /// Mean over the neighbours of a place; zero without any.
    pub(super) fn mean(&self, place: usize, values: &[Vec3]) -> Vec3 {
        let around = self.around.row(place);
        let sum: Vec3 = around.iter().map(|&i| values[i as usize]).sum();
        sum / around.len().max(1) as f32
    }
}

impl Rows {
    /// From pairs of a row and an entry.
    pub(super) fn new(rows: usize, mut pairs: Vec<[u32; 2]>) -> Self {
        pairs.sort_unstable();
        pairs.dedup();
        let count = |row: u32| pairs.partition_point(|&[of, _]| of < row) as u32;
        Self {
            starts: (0..=rows as u32).map(count).collect(),
            entries: pairs.iter().map(|&[_, entry]| entry).collect(),
        }
    }

    pub(super) fn row(&self, row: usize) -> &[u32] {
        &self.entries[self.starts[row] as usize..self.starts[row + 1] as usize]
    }
}
