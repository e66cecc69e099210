//! Light paths: vertices, sub-path tracing, densities, the measurement contribution.
//!
//! A path is x0 … xk with x0 on a light and xk on the lens (Veach's order). All densities are in the area measure; a
//! vertex at infinity carries the directional measure instead and its edge has only the far cosine in G.
//!
//! Deltas cancel between f and the densities: a specular vertex carries its coefficient and the probability of its
//! mode, both with respect to the light-side direction ω_l, which is why the light-side density of a transmission holds
//! the factor dω_l/dω_e.

mod bidir;
mod emitter;
mod eye;
mod lens;
mod link;
mod palette;
mod pool;
mod sequence;
mod site;
mod strategies;
mod tally;
mod trace;
mod vertex;
mod walk;
mod world;

pub use bidir::{Heuristic, Joined, Sampler};
pub use emitter::{Emitters, LightPoint};
pub use eye::eye_on_surface;
pub use lens::Lens;
pub use link::{Link, ScatterTerms, scatter_terms};
pub use palette::Palette;
pub use pool::Pool;
pub use sequence::{Ends, Path};
pub use site::{Site, Sites};
pub use strategies::{deletion_length, exp2i, half_to};
pub use tally::{Fault, Tally};
pub use trace::{Start, deflect, follow, scatter, trace, trace_into, trace_ray};
pub use vertex::{Kind, Vertex};
pub use world::World;
