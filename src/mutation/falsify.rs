//! Errors that tests put into a density, to show that they would be seen. Outside of tests nothing is left of this.

/// The densities that can be falsified, each on a part of its domain: a constant factor would cancel in every ratio.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Density {
    /// p_d at paths of an odd number of edges.
    Deletion,
    /// p_a of more edges than were deleted.
    Insertion,
    /// Σ p_{l+i} of paths seen in odd rows of pixels.
    Strategies,
    /// The lens perturbation's density of paths seen in odd rows of pixels.
    Lens,
    /// The caustic perturbation's density of paths seen in odd rows of pixels.
    Caustic,
    /// The multi-chain perturbation's density of paths seen in odd rows of pixels.
    MultiChain,
    /// The lens sub-path mutation's density of paths seen in odd rows of pixels.
    LensSubpath,
    /// The wavelength mutation's density of u < 1/2.
    Wavelength,
}

#[cfg(test)]
thread_local! {
    /// The false density of this thread.
    pub(crate) static FALSE: std::cell::Cell<Option<Density>> = const { std::cell::Cell::new(None) };
}

/// A false density's factor where `part` holds.
#[inline(always)]
pub(crate) fn factor(_density: Density, _part: bool) -> f64 {
    #[cfg(test)]
    if _part && FALSE.get() == Some(_density) {
        return 1.05;
    }
    1.0
}

/// The path is seen in an odd row of pixels.
#[inline(always)]
pub(crate) fn odd_row<const N: usize>(y: &crate::path::Path<N>) -> bool {
    y.raster.y as u32 % 2 == 1
}
