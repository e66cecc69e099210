//! A path as bytes: 13 a vertex on a surface, 4 more for one of an instance, 13 on the lens and in the sky, 5 for a delta
//! light.

use crate::accel::Accel;
use crate::accel::surface::surface_again;
use crate::film::{Malformed, Reader, Writer};
use crate::path::{Kind, Palette, Path, Pool, Tally, Vertex, World};
use crate::real::{Convert, Real, Vec2, Vec3};
use crate::scatter::Mode;
use crate::scene::{Light, NONE, PrimId};
use std::io;

const WORLD: u8 = 0;
const INSTANCE: u8 = 1;
const LENS: u8 = 2;
const SKY: u8 = 3;
const DELTA: u8 = 4;

/// Bits of the first byte that hold one of the above; the mode stands above them.
const KINDS: u8 = 8;

/// Most vertices that are read.
const MOST: usize = 1 << 12;

/// Writes a path's vertices and modes.
pub(super) fn save<const N: usize>(
    path: &Path<N>,
    pool: &Pool<N>,
    w: &mut Writer,
) -> io::Result<()> {
    w.u32(path.links.len() as u32)?;
    for link in &path.links {
        let v = pool.get(link.slot);
        let kind = match v.kind {
            Kind::Surface if v.prim().instance().is_some() => INSTANCE,
            Kind::Surface => WORLD,
            Kind::Lens => LENS,
            Kind::Infinite if v.light == NONE => SKY,
            Kind::Infinite | Kind::Point => DELTA,
        };
        w.u8(kind + KINDS * link.mode as u8)?;
        if v.kind == Kind::Surface {
            let prim = v.prim();
            prim.instance().map_or(Ok(()), |i| w.u32(i))?;
            w.u32(prim.prim())?;
            w.real(v.at.x)?;
            w.real(v.at.y)?;
        }
        match kind {
            LENS | SKY => v.p.to_array().into_iter().try_for_each(|c| w.real(c))?,
            DELTA => w.u32(v.light)?,
            _ => {}
        }
    }
    Ok(())
}

/// Reads a number of transport, in as many bytes as it was written in.
pub(super) type Number = fn(&mut Reader) -> Result<Real, Malformed>;

fn read_vector(r: &mut Reader, number: Number) -> Result<Vec3, Malformed> {
    Ok(Vec3::new(number(r)?, number(r)?, number(r)?))
}

/// Makes the path again, at the wavelengths that stand in it: vertices, links, spectrum.
pub(super) fn read<const N: usize, A: Accel>(
    world: &World<A>,
    path: &mut Path<N>,
    pool: &mut Pool<N>,
    r: &mut Reader,
) -> Result<(), Malformed> {
    if read_as(world, path, pool, r, |r| r.real())? {
        Ok(())
    } else {
        Err(Malformed::new("has a path that carries no light"))
    }
}

/// As [`read`], of numbers of another build; false if the path carries no light.
pub(super) fn read_as<const N: usize, A: Accel>(
    world: &World<A>,
    path: &mut Path<N>,
    pool: &mut Pool<N>,
    r: &mut Reader,
    number: Number,
) -> Result<bool, Malformed> {
    let n = r.count(5)?;
    if !(2..=(world.max_edges + 1).min(MOST)).contains(&n) {
        return Err(Malformed(format!(
            "has a path of {n} vertices, where 2 to {} may be",
            world.max_edges + 1
        )));
    }
    let mut palette = Palette::new(path.lanes);
    palette.tune(&path.lanes);
    path.clear();
    for i in 0..n {
        let (vertex, mode) = read_vertex(world, &palette, r, number)?;
        let last = i + 1 == n;
        let fits = match vertex.kind {
            Kind::Lens => last,
            Kind::Surface if i == 0 => vertex.light != NONE,
            Kind::Surface => !last,
            Kind::Point | Kind::Infinite => i == 0,
        };
        if !fits {
            let what = vertex.kind;
            return Err(Malformed(format!(
                "has a path whose vertex {i} of {n} is {what:?}"
            )));
        }
        path.push(pool.put(vertex), mode);
    }
    path.relink(world, pool, 0, n - 1);
    Ok(path.measure(world, pool, &mut Tally::default()))
}

/// A direction of which f32 may have been kept, of unit length to the digits of this build.
fn direction(w: Vec3) -> Vec3 {
    if cfg!(feature = "double") {
        w.normalize()
    } else {
        w
    }
}

fn read_vertex<const N: usize, A: Accel>(
    world: &World<A>,
    palette: &Palette<N>,
    r: &mut Reader,
    number: Number,
) -> Result<(Vertex<N>, Mode), Malformed> {
    let scene = world.scene;
    let first = r.u8()?;
    let mode = match first / KINDS {
        0 => Mode::NonSpecular,
        1 => Mode::Reflect,
        2 => Mode::Transmit,
        m => return Err(Malformed(format!("has a vertex of mode {m}"))),
    };
    let geometry = &scene.geometry;
    let vertex = match first % KINDS {
        kind @ (WORLD | INSTANCE) => {
            let instance = match kind {
                WORLD => None,
                _ => Some(r.u32()?),
            };
            let prim = r.u32()?;
            let id = match instance {
                None => PrimId::of(prim),
                Some(i) if (i as usize) < geometry.instances.len() => PrimId::through(i, prim),
                Some(i) => return Err(Malformed(format!("has a vertex on instance {i}"))),
            };
            let at = Vec2::new(number(r)?, number(r)?);
            let (_, part, _) = geometry.resolve(id);
            let there = (prim as usize) < part.prim_count();
            if !there || !at.is_finite() {
                return Err(Malformed(format!("has a vertex at {at} of {id}")));
            }
            let s = surface_again(geometry, id, at);
            Vertex::from_surface(scene, id, &s, palette)
        }
        LENS => world.lens.vertex(read_vector(r, number)?),
        SKY => {
            world
                .emitters
                .sky_vertex(scene, palette.lanes(), direction(read_vector(r, number)?))
        }
        DELTA => {
            let light = r.u32()?;
            let (kind, p) = match scene.lights.get(light as usize) {
                Some(Light::Point { position, .. } | Light::Spot { position, .. }) => {
                    (Kind::Point, position.real())
                }
                Some(Light::Distant { direction, .. }) => (Kind::Infinite, -direction.real()),
                _ => return Err(Malformed(format!("has a vertex at light {light}"))),
            };
            let mut v = Vertex::bare(kind, p, Vec3::ZERO, light);
            v.emission = palette.emission(scene, light);
            v
        }
        kind => return Err(Malformed(format!("has a vertex of kind {kind}"))),
    };
    Ok((vertex, mode))
}
