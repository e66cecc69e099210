//! Mutation strategies by name, and how often each is proposed.

use serde::Serialize;

/// The strategies, in the order in which statistics list them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Strategy {
    /// Replaces a sub-path (Veach 11.4.2).
    Bidirectional,
    /// Moves the raster point a little (Veach 11.4.3.1).
    Lens,
    /// Turns a direction on the light side a little (Veach 11.4.3.2).
    Caustic,
    /// Moves the raster point, and directions between specular chains, a little (Veach 11.4.3.3).
    MultiChain,
    /// Replaces the lens sub-path by a stratified one (Veach 11.4.4).
    LensSubpath,
    /// Redraws the wavelengths.
    Wavelength,
}

impl Strategy {
    /// All strategies.
    pub const ALL: [Self; 6] = [
        Self::Bidirectional,
        Self::Lens,
        Self::Caustic,
        Self::MultiChain,
        Self::LensSubpath,
        Self::Wavelength,
    ];

    /// Name as used on the command line and in statistics.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bidirectional => "bidirectional",
            Self::Lens => "lens",
            Self::Caustic => "caustic",
            Self::MultiChain => "multichain",
            Self::LensSubpath => "lenssubpath",
            Self::Wavelength => "wavelength",
        }
    }
}

/// Relative shares of the strategies; among those suited to a path they are normalised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares(pub [f64; Strategy::ALL.len()]);

impl Default for Shares {
    /// For coloured scenes without a delta lobe.
    fn default() -> Self {
        Self([0.35, 0.55, 0.0, 0.0, 0.05, 0.05])
    }
}

impl Shares {
    /// The fixed shares where some strategies are called for. What caustic and multi-chain perturbations do not use is
    /// the lens perturbation's.
    pub fn of(caustic: bool, multi_chain: bool, wavelength: bool) -> Self {
        let mut shares = Self::default();
        let mut share = |s: Strategy, v| shares.0[s as usize] = v;
        if caustic {
            share(Strategy::Caustic, 0.1);
        }
        if multi_chain {
            share(Strategy::MultiChain, 0.1);
        }
        share(
            Strategy::Lens,
            match (caustic, multi_chain) {
                (false, false) => 0.55,
                (true, true) => 0.35,
                _ => 0.45,
            },
        );
        if !wavelength {
            shares = shares.without(Strategy::Wavelength);
        }
        shares
    }

    /// Only the given strategy, beside a part of bidirectional mutations.
    pub fn only(s: Strategy, bidirectional: f64) -> Self {
        let mut v = [0.0; Strategy::ALL.len()];
        v[Strategy::Bidirectional as usize] = bidirectional;
        v[s as usize] += 1.0 - bidirectional;
        Self(v)
    }

    /// The same share for every strategy that has one.
    pub fn leveled(self) -> Self {
        let n = self.0.iter().filter(|v| **v > 0.0).count().max(1) as f64;
        Self(self.0.map(|v| if v > 0.0 { 1.0 / n } else { 0.0 }))
    }

    /// The share of a strategy.
    pub fn get(&self, s: Strategy) -> f64 {
        self.0[s as usize]
    }

    /// The same with no share for `s`; the others keep their proportions.
    pub fn without(mut self, s: Strategy) -> Self {
        self.0[s as usize] = 0.0;
        self
    }
}
