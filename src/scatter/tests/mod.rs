//! Properties every lobe must have.
