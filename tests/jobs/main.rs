//! Runs that are stopped, killed, shared out and gone on with make the image of one that was never touched, bit for bit.

mod batch;
mod bytes;
mod damage;
mod engines;
mod files;
mod full_disk;
mod kill;
mod layers;
mod parts;
mod preview;
mod resume;
mod runs;
mod voice;
