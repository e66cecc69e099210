//! Fixed storage for vertices, so that a Markov step allocates nothing.

use super::{Kind, Vertex};
use crate::real::Vec3;
use crate::scene::NONE;

/// Vertices shared by the paths of one chain.
pub struct Pool<const N: usize> {
    slots: Vec<Vertex<N>>,
    free: Vec<u16>,
}

impl<const N: usize> Pool<N> {
    /// Room for `capacity` vertices.
    pub fn new(capacity: usize) -> Self {
        let blank = Vertex::bare(Kind::Point, Vec3::ZERO, Vec3::ZERO, NONE);
        Self {
            slots: vec![blank; capacity],
            free: (0..capacity as u16).rev().collect(),
        }
    }

    /// Stores a vertex.
    #[inline]
    pub fn put(&mut self, v: Vertex<N>) -> u16 {
        let i = self.take();
        self.slots[i as usize] = v;
        i
    }

    /// Takes a slot, whatever it holds.
    #[inline]
    pub fn take(&mut self) -> u16 {
        self.free
            .pop()
            .expect("a pool holds two paths of the greatest length")
    }

    /// The vertex in a slot, to be overwritten.
    #[inline]
    pub fn get_mut(&mut self, i: u16) -> &mut Vertex<N> {
        &mut self.slots[i as usize]
    }

    /// Gives a slot back.
    #[inline]
    pub fn release(&mut self, slot: u16) {
        self.free.push(slot);
    }

    /// The vertex in a slot.
    #[inline]
    pub fn get(&self, i: u16) -> &Vertex<N> {
        &self.slots[i as usize]
    }

    /// Gives all slots back.
    pub fn reset(&mut self) {
        self.free.clear();
        self.free.extend((0..self.slots.len() as u16).rev());
    }

    /// Number of free slots.
    pub fn free_slots(&self) -> usize {
        self.free.len()
    }
}
