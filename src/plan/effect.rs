//! The effects that a scene may call for, by name.

use serde::Serialize;

/// Something that is simulated only where a scene calls for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Effect {
    /// Light of more than one spectral shape.
    Colour,
    /// Directions that depend on the wavelength.
    Dispersion,
    /// Chains of mirror reflection and clear refraction.
    Specular,
    /// The caustic perturbation.
    Caustic,
    /// The multi-chain perturbation.
    MultiChain,
    /// A lens with an area.
    Aperture,
    /// Light from infinity that is no delta.
    Environment,
    /// Materials that vary over a surface.
    Textures,
    /// Normals interpolated between vertices.
    Normals,
    /// Surfaces that are there only in part.
    Alpha,
    /// Triangles so thin that a test in f32 cannot tell on which side of them a point is.
    Slivers,
    /// Objects that stand in several places.
    Instances,
    /// Light after more than one scattering, so that a Markov chain has paths to own.
    Indirect,
}

impl Effect {
    /// All of them, in the order in which a plan tells them.
    pub const ALL: [Self; 13] = [
        Self::Colour,
        Self::Dispersion,
        Self::Specular,
        Self::Caustic,
        Self::MultiChain,
        Self::Aperture,
        Self::Environment,
        Self::Textures,
        Self::Normals,
        Self::Alpha,
        Self::Slivers,
        Self::Instances,
        Self::Indirect,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Colour => "colour",
            Self::Dispersion => "dispersion",
            Self::Specular => "specular",
            Self::Caustic => "caustic",
            Self::MultiChain => "multichain",
            Self::Aperture => "aperture",
            Self::Environment => "environment",
            Self::Textures => "textures",
            Self::Normals => "normals",
            Self::Alpha => "alpha",
            Self::Slivers => "slivers",
            Self::Instances => "instances",
            Self::Indirect => "indirect",
        }
    }

    /// What is left out where nothing calls for it.
    pub fn skipped(self) -> &'static str {
        match self {
            Self::Colour => {
                "one lane and no wavelength mutation; the lights' one colour is multiplied in at the end"
            }
            Self::Dispersion => "no path is reduced to its hero wavelength",
            Self::Specular => "no path has a chain of deltas to trace or to keep",
            Self::Caustic | Self::MultiChain => "no proposal is spent on this strategy",
            Self::Aperture => {
                "rays start at one point, and light sub-paths are not asked whether they pass the lens"
            }
            Self::Environment => "a ray that leaves the scene ends there",
            Self::Textures => {
                "what a material is made of is remembered, not looked up at every hit"
            }
            Self::Normals => "the geometric normal is the shading normal",
            Self::Alpha => "Embree has no filter callback",
            Self::Slivers => "no ray leaves out the triangle that it starts on",
            Self::Instances => "Embree has one level, in world space",
            Self::Indirect => "no Markov chain: the direct pass is the whole image",
        }
    }

    /// What is wrong with an image that is made without it.
    pub fn missed(self) -> &'static str {
        match self {
            Self::Colour => {
                "the image is monochrome: every light has the first light's colour, every surface the grey it has at the \
                 one wavelength that is followed"
            }
            Self::Dispersion => "glass refracts all colours as it refracts 587.6 nm: no rainbows",
            Self::Specular => {
                "mirrors and clear glass are black, coats are matte, and what is seen or lit through them is missing"
            }
            Self::Caustic | Self::MultiChain => {
                "nothing is wrong with the image, but what this strategy explores well is noisier"
            }
            Self::Aperture => "everything is in focus",
            Self::Environment => "light from infinity is missing (parallel light stays)",
            Self::Textures => "each texture is replaced by one value that stands for it",
            Self::Normals => "curved meshes show their facets",
            Self::Alpha => "nothing",
            Self::Slivers => {
                "needles shade themselves: some of the rays that leave them meet them again"
            }
            Self::Instances => {
                "nothing is wrong with the image, but every place of an object takes as much memory as the object"
            }
            Self::Indirect => "light that scattered more than once is missing",
        }
    }
}

impl std::fmt::Display for Effect {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl std::str::FromStr for Effect {
    type Err = String;

    fn from_str(s: &str) -> Result<Self, String> {
        let names = || Self::ALL.map(Self::name).join(", ");
        let found = Self::ALL.into_iter().find(|e| e.name() == s);
        found.ok_or_else(|| format!("found “{s}”, expected one of {}", names()))
    }
}
