//! What the reader carries from directive to directive.

use super::LoadOptions;
use super::error::{Fault, Location, Result, SceneError};
use super::image::Images;
use super::light::{AreaLight, PendingLight};
use super::material::MaterialRef;
use super::objects::{Definition, Objects};
use super::params::{Param, Params};
use super::place::World;
use super::setting::Settings;
use super::spectra::Emitted;
use super::transform::singular;
use crate::scene::material::Material;
use crate::scene::texture::{FloatTexture, SpectrumTexture};
use crate::scene::{Source, Sources};
use glam::DMat4;
use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Where file names of the scene lead: relative ones start at the folder of the top-level file, as in pbrt-v4.
#[derive(Clone, Debug)]
pub(super) struct Files {
    pub(super) base: PathBuf,
    /// All files that the scene is made of, so far.
    pub(super) seen: Rc<RefCell<Vec<PathBuf>>>,
}

impl Files {
    pub(super) fn resolve(&self, name: &str) -> PathBuf {
        let path = self.base.join(Path::new(name));
        self.seen.borrow_mut().push(path.clone());
        path
    }
}

/// Named things and what they refer to.
pub(super) struct Library {
    pub(super) files: Files,
    pub(super) images: Images,
    pub(super) materials: Vec<Material>,
    pub(super) names: HashMap<String, MaterialRef>,
    pub(super) float_textures: HashMap<String, FloatTexture>,
    pub(super) spectrum_textures: HashMap<String, SpectrumTexture>,
    /// D65 with its luminance.
    pub(super) white: Emitted,
}

/// The kinds of directive an `Attribute` line gives defaults for.
pub(super) const ATTRIBUTE_TARGETS: [&str; 5] = ["shape", "light", "material", "medium", "texture"];

/// What `AttributeBegin` saves.
#[derive(Clone)]
pub(super) struct GraphicsState {
    pub(super) ctm: DMat4,
    pub(super) reverse: bool,
    pub(super) material: MaterialRef,
    pub(super) area_light: Option<Rc<AreaLight>>,
    /// Parallel to [`ATTRIBUTE_TARGETS`].
    pub(super) defaults: [Vec<Rc<Param>>; 5],
    /// False after `ActiveTransform EndTime`: transforms then belong to the end of the shutter only.
    pub(super) start_active: bool,
}

/// A directive that is looked at when the file has been read.
pub(super) struct Pending {
    pub(super) kind: String,
    pub(super) params: Params,
}

/// The directives before `WorldBegin`.
#[derive(Default)]
pub(super) struct Prelude {
    pub(super) camera: Option<(Pending, DMat4)>,
    pub(super) film: Option<Pending>,
    pub(super) filter: Option<Pending>,
    pub(super) sampler: Option<Pending>,
    pub(super) integrator: Option<Pending>,
}

/// The reader's state.
pub(super) struct Loader {
    pub(super) lenient: bool,
    pub(super) settings: Settings,
    pub(super) warnings: Vec<String>,
    pub(super) gs: GraphicsState,
    /// Saved states, with the directive that saved each and its place.
    pub(super) stack: Vec<(&'static str, Location, GraphicsState)>,
    pub(super) coordinate_systems: HashMap<String, DMat4>,
    pub(super) in_world: bool,
    pub(super) prelude: Prelude,
    pub(super) library: Library,
    pub(super) world: World,
    pub(super) lights: Vec<PendingLight>,
    pub(super) objects: Objects,
    pub(super) object: Option<Definition>,
    pub(super) sources: Sources,
    /// Files being read, outermost first.
    pub(super) open_files: Vec<PathBuf>,
}

impl Loader {
    pub(super) fn new(base: &Path, options: &LoadOptions) -> Self {
        Self {
            lenient: options.lenient,
            settings: Settings::new(&options.settings),
            warnings: Vec::new(),
            gs: GraphicsState {
                ctm: DMat4::IDENTITY,
                reverse: false,
                material: MaterialRef::Default,
                area_light: None,
                defaults: Default::default(),
                start_active: true,
            },
            stack: Vec::new(),
            coordinate_systems: HashMap::new(),
            in_world: false,
            prelude: Prelude::default(),
            library: Library {
                files: Files {
                    base: base.into(),
                    seen: Rc::default(),
                },
                images: Images::default(),
                materials: Vec::new(),
                names: HashMap::new(),
                float_textures: HashMap::new(),
                spectrum_textures: HashMap::new(),
                white: Emitted::white(),
            },
            world: World::default(),
            lights: Vec::new(),
            objects: Objects::default(),
            object: None,
            sources: Sources::default(),
            open_files: Vec::new(),
        }
    }

    /// Says something about the scene that is no error.
    pub(super) fn warn(&mut self, at: &Location, message: impl std::fmt::Display) {
        self.warnings.push(format!("{at}: {message}"));
    }

    /// Lets a lenient reader pass over what is not supported: `None` then, with a warning.
    pub(super) fn tolerate<T>(&mut self, result: Result<T>) -> Result<Option<T>> {
        match result {
            Ok(v) => Ok(Some(v)),
            Err(e) if self.lenient && e.fault == Fault::Unsupported => {
                self.warnings.push(format!("ignored: {e}"));
                Ok(None)
            }
            Err(e) => Err(e),
        }
    }

    /// [`Self::tolerate`] for each of a list of complaints.
    pub(super) fn complain(&mut self, errors: Vec<SceneError>) -> Result<()> {
        for e in errors {
            self.tolerate(Err::<(), _>(e))?;
        }
        Ok(())
    }

    /// Multiplies the current transform on the right, as every pbrt transform directive does.
    pub(super) fn concat(&mut self, m: DMat4, at: &Location, what: &str) -> Result<()> {
        self.set_ctm(self.gs.ctm * m, at, what)
    }

    /// Replaces the current transform.
    pub(super) fn set_ctm(&mut self, m: DMat4, at: &Location, what: &str) -> Result<()> {
        if super::transform::projective(&m) {
            return Err(SceneError::value(at, format!("{what} is not affine"))
                .found(format!("the last row {:?}", m.row(3).to_array()))
                .expected("0 0 0 1"));
        }
        if !m.is_finite() || singular(&m) {
            return Err(SceneError::value(
                at,
                format!("{what} makes the transform singular"),
            ));
        }
        if self.gs.start_active {
            self.gs.ctm = m;
        }
        Ok(())
    }

    /// Index of a material, making pbrt's default one when it is first needed; `None` is the interface.
    pub(super) fn material_index(&mut self, at: &Location) -> Option<u32> {
        match self.gs.material {
            MaterialRef::Index(i) => Some(i),
            MaterialRef::Interface => None,
            MaterialRef::Default => {
                let existing = self.library.names.get("\0default").copied();
                let made = existing.unwrap_or_else(|| {
                    use crate::scene::spectrum::Curve;
                    let reflectance = SpectrumTexture::Constant(Curve::Constant(0.5));
                    let m = self.add_material(
                        Material::Diffuse { reflectance },
                        source("the default material", at),
                    );
                    self.library.names.insert("\0default".into(), m);
                    m
                });
                match made {
                    MaterialRef::Index(i) => Some(i),
                    _ => None,
                }
            }
        }
    }

    /// Adds a material to the scene.
    pub(super) fn add_material(&mut self, material: Material, source: Source) -> MaterialRef {
        self.library.materials.push(material);
        self.sources.materials.push(source);
        MaterialRef::Index((self.library.materials.len() - 1) as u32)
    }
}

/// The name and place of something in the scene.
pub(super) fn source(label: impl Into<std::sync::Arc<str>>, at: &Location) -> Source {
    Source {
        label: label.into(),
        at: at.clone(),
    }
}
