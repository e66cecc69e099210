//! Small closed rooms in which every kind of vertex occurs, and paths in them.

use crate::accel::{Embree, EmbreeOptions};
use crate::path::{Heuristic, Path, Pool, Sampler, Tally, World};
use crate::real::{Real, Vec2};
use crate::sampling::Rng;
use crate::scatter::Mode;
use crate::scene::load::{LoadOptions, load_str};
use crate::scene::spectrum::Lanes;

/// What the suite runs on.
pub(super) type Room<'a> = World<'a, Embree<'a>>;

/// What stands in the box.
#[derive(Clone, Copy)]
pub(super) struct Contents {
    inside: &'static str,
    /// Without it the sky looks in.
    ceiling: bool,
    /// Paths with a specular chain behind a diffuse vertex, seen from the lens, are common.
    pub(super) chains: bool,
}

/// Diffuse vertices only.
pub(super) const BOX: Contents = Contents {
    inside: "",
    ceiling: true,
    chains: false,
};

/// A glass ball, dispersive, and a mirror: (L|D)DS*E and its like.
pub(super) const GLASS: Contents = Contents {
    inside: r#"
Material "dielectric" "spectrum eta" "glass-BK7"
AttributeBegin
  Translate 0.3 0.28 0.55
  Shape "sphere" "float radius" 0.18
AttributeEnd
Material "conductor" "rgb reflectance" [ 0.9 0.8 0.7 ]
Shape "trianglemesh" "point3 P" [ 0.6 0.1 0.9  0.95 0.1 0.6  0.95 0.7 0.6  0.6 0.7 0.9 ]
  "integer indices" [ 0 1 2 0 2 3 ]
"#,
    ceiling: true,
    chains: true,
};

/// Rough metal and coated surfaces with and without a delta lobe.
pub(super) const GLOSSY: Contents = Contents {
    inside: r#"
Material "conductor" "float roughness" 0.25
AttributeBegin
  Translate 0.3 0.25 0.6
  Shape "sphere" "float radius" 0.2
AttributeEnd
Material "coateddiffuse" "rgb reflectance" [ 0.3 0.5 0.2 ] "float roughness" 0.3
Shape "trianglemesh" "point3 P" [ 0.6 0.1 0.9  0.95 0.1 0.6  0.95 0.7 0.6  0.6 0.7 0.9 ]
  "integer indices" [ 0 1 2 0 2 3 ]
Material "coateddiffuse" "rgb reflectance" [ 0.6 0.2 0.2 ] "float roughness" 0
Shape "trianglemesh" "point3 P" [ 0.05 0.02 0.05  0.05 0.02 0.95  0.95 0.02 0.95  0.95 0.02 0.05 ]
  "integer indices" [ 0 1 2 0 2 3 ]
"#,
    ceiling: true,
    chains: false,
};

/// A sky, a sun and a bulb; a rough glass ball, a pane, and a wall whose shading normals lean.
pub(super) const OPEN: Contents = Contents {
    inside: r#"
LightSource "infinite" "rgb L" [ 0.4 0.5 0.7 ]
LightSource "distant" "point3 from" [ 0.2 1 -0.3 ] "point3 to" [ 0 0 0 ] "rgb L" [ 2 1.8 1.5 ]
LightSource "point" "point3 from" [ 0.8 0.7 0.3 ] "rgb I" [ 0.3 0.3 0.2 ]
Material "dielectric" "float eta" 1.4 "float roughness" 0.2
AttributeBegin
  Translate 0.3 0.28 0.55
  Shape "sphere" "float radius" 0.18
AttributeEnd
Material "thindielectric"
Shape "trianglemesh" "point3 P" [ 0.5 0.05 0.5  0.9 0.05 0.6  0.9 0.5 0.6  0.5 0.5 0.5 ]
  "integer indices" [ 0 1 2 0 2 3 ]
Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.2 ]
Shape "trianglemesh" "point3 P" [ 0.6 0.1 0.9  0.95 0.1 0.7  0.95 0.7 0.7  0.6 0.7 0.9 ]
  "normal N" [ -0.8 -0.3 -0.7  -0.1 -0.3 -1  -0.1 0.3 -1  -0.8 0.3 -0.7 ]
  "integer indices" [ 0 1 2 0 2 3 ]
"#,
    ceiling: false,
    chains: false,
};

/// A plate of glass between lamp and floor: LSSDE, and LSSDSSE where the plate is seen through.
pub(super) const PLATE: Contents = Contents {
    inside: r#"
Material "dielectric" "float eta" 1.5
Shape "trianglemesh"
  "point3 P" [ 0.1 0.5 0.25  0.9 0.5 0.25  0.9 0.5 0.95  0.1 0.5 0.95
               0.1 0.56 0.25  0.9 0.56 0.25  0.9 0.56 0.95  0.1 0.56 0.95 ]
  "integer indices" [ 0 1 2 0 2 3  4 6 5 4 7 6  0 5 1 0 4 5  1 6 2 1 5 6  2 7 3 2 6 7  3 4 0 3 7 4 ]
"#,
    ceiling: true,
    chains: true,
};

/// A wedge of flint glass between lamp and floor, dispersive: LSSDE of one colour each, and (L|D)DSSE where the wedge is
/// seen through.
pub(super) const WEDGE: Contents = Contents {
    inside: r#"
Material "dielectric" "spectrum eta" "glass-F11"
Shape "trianglemesh"
  "point3 P" [ 0.1 0.5 0.25  0.9 0.5 0.25  0.9 0.5 0.95  0.1 0.5 0.95
               0.1 0.52 0.25  0.9 0.7 0.25  0.9 0.7 0.95  0.1 0.52 0.95 ]
  "integer indices" [ 0 1 2 0 2 3  4 6 5 4 7 6  0 5 1 0 4 5  1 6 2 1 5 6  2 7 3 2 6 7  3 4 0 3 7 4 ]
"#,
    ceiling: true,
    chains: true,
};

/// Water over the floor, seen from above, under a large lamp: LSDSE.
pub(super) const POOL: Contents = Contents {
    inside: r#"
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 3 2.5 2 ]
Shape "trianglemesh" "point3 P" [ 0.1 0.9 0.1  0.9 0.9 0.1  0.9 0.9 0.9  0.1 0.9 0.9 ]
  "integer indices" [ 0 1 2 0 2 3 ]
AttributeEnd
Material "dielectric" "float eta" 1.33
Shape "trianglemesh" "point3 P" [ -0.01 0.3 -0.01  -0.01 0.3 1.01  1.01 0.3 1.01  1.01 0.3 -0.01 ]
  "integer indices" [ 0 1 2 0 2 3 ]
"#,
    ceiling: true,
    chains: true,
};

/// A unit box whose walls are coloured, with a lamp under its ceiling.
fn text(contents: Contents, aperture: Real) -> String {
    let inside = contents.inside;
    let ceiling = if contents.ceiling { "4 5 6 4 6 7" } else { "" };
    format!(
        r#"
Film "rgb" "integer xresolution" 24 "integer yresolution" 24 "string filename" "x.exr"
PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5
LookAt 0.5 0.45 0.03  0.5 0.45 1  0 1 0
Camera "perspective" "float fov" 75 "float lensradius" {aperture} "float focaldistance" 0.6
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.6 0.6 0.6 ]
Shape "trianglemesh" "point3 P" [ 0 0 0  1 0 0  1 0 1  0 0 1  0 1 0  1 1 0  1 1 1  0 1 1 ]
  "integer indices" [ 0 1 2 0 2 3 {ceiling} 2 3 7 2 7 6 0 1 5 0 5 4 ]
Material "diffuse" "rgb reflectance" [ 0.6 0.1 0.1 ]
Shape "trianglemesh" "point3 P" [ 0 0 0  0 0 1  0 1 1  0 1 0 ] "integer indices" [ 0 1 2 0 2 3 ]
Material "diffuse" "rgb reflectance" [ 0.1 0.5 0.15 ]
Shape "trianglemesh" "point3 P" [ 1 0 0  1 0 1  1 1 1  1 1 0 ] "integer indices" [ 0 1 2 0 2 3 ]
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 12 10 7 ]
Material "diffuse" "rgb reflectance" [ 0.4 0.4 0.4 ]
Shape "trianglemesh" "point3 P" [ 0.3 0.95 0.35  0.6 0.95 0.35  0.6 0.95 0.65  0.3 0.95 0.65 ]
  "integer indices" [ 0 1 2 0 2 3 ]
AttributeEnd
{inside}
"#
    )
}

/// Calls `f` with a room; paths have at most `max_edges` edges.
pub(super) fn with_room<R>(
    contents: Contents,
    aperture: Real,
    max_edges: usize,
    f: impl FnOnce(&Room) -> R,
) -> R {
    let scene = load_str(
        &text(contents, aperture),
        std::path::Path::new("."),
        &LoadOptions::default(),
    )
    .expect("the room is a scene");
    let accel = Embree::new(&scene.geometry, EmbreeOptions::default()).expect("Embree builds");
    f(&World::new(&scene, &accel, max_edges as u32 - 1))
}

/// Seeds: bidirectional samples, each keeping one of its paths in proportion to its weight (Veach 11.3.1).
pub(super) struct Seeds<const N: usize> {
    pub(super) sampler: Sampler<N>,
    indirect_only: bool,
    pub(super) tally: Tally,
}

impl<const N: usize> Seeds<N> {
    pub(super) fn new(world: &Room, indirect_only: bool) -> Self {
        Self {
            sampler: Sampler::new(world.max_edges),
            indirect_only,
            tally: Tally::default(),
        }
    }

    /// One sample's weight; its path stands in the sampler if the weight is not 0.
    pub(super) fn draw(&mut self, world: &Room, rng: &mut Rng) -> f64 {
        let lanes = Lanes::new(rng.next_f32());
        let raster = world.lens.sample_raster(rng.next_vec2());
        self.sampler
            .sample(world, &lanes, raster, rng, &mut self.tally);
        let (mut weight, mut pick) = (0.0, (0, 0));
        let indirect = self.indirect_only;
        self.sampler.join(
            world,
            Heuristic::Balance,
            indirect,
            &mut self.tally,
            |j, _| {
                weight += j.weight;
                if rng.next_f64() * weight < j.weight {
                    pick = (j.s, j.t);
                }
            },
        );
        if weight > 0.0 {
            self.sampler.join_one(
                world,
                pick.0,
                pick.1,
                Heuristic::Balance,
                indirect,
                &mut self.tally,
            );
        }
        weight
    }
}

/// Where a path lies in path space: the families of cells that the suite tells apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cell(pub(super) [u32; 5]);

/// Names of the families.
pub(super) const FAMILIES: [&str; 5] = ["length", "modes", "image", "wavelength", "all"];

/// Halves of the image crossed with odd and even rows, so that small moves change cells too.
pub(super) fn image_cell(world: &Room, raster: Vec2) -> u32 {
    let left = raster.x < 0.5 * (world.lens.lo.x + world.lens.hi.x);
    left as u32 + 2 * (raster.y as u32 % 2)
}

impl Cell {
    pub(super) fn of<const N: usize>(world: &Room, x: &Path<N>) -> Self {
        let k = x.k();
        // One bit a vertex, so that the mask tells where the specular vertices are.
        let modes = (1..k).fold(1u32 << k, |m, i| {
            m | ((x.links[i].mode != Mode::NonSpecular) as u32) << i
        });
        let image = image_cell(world, x.raster);
        let wave = (x.lanes.u < 0.5) as u32;
        Self([k as u32, modes, image, wave, modes << 3 | image << 1 | wave])
    }
}

/// A copy of a path and its vertices in another pool.
pub(super) fn copy<const N: usize>(
    path: &Path<N>,
    pool: &Pool<N>,
    into: &mut Pool<N>,
    max_edges: usize,
) -> Path<N> {
    let mut x = path.clone_capacity(max_edges);
    x.copy_from(path);
    for link in &mut x.links {
        link.slot = into.put(*pool.get(link.slot));
    }
    x
}
