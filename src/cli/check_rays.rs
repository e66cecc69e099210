//! `metrolux check-rays`.

use super::CliError;
use super::bench_accel::read_rays;
use crate::accel::record::Kind;
use crate::accel::{Accel, Checked, Disagreement, Embree, EmbreeOptions, Obvhs, Ray};
use crate::output::ImageError;
use crate::scene::Geometry;
use crate::scene::load::{LoadOptions, load_scene};
use crate::study::bench_accel::sets::{RaySet, of_scene};
use crate::study::bench_accel::terrain;
use clap::Args;
use glam::Vec3;
use rayon::prelude::*;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Ask Embree and obvhs the same rays and judge where they differ
///
/// Every difference is judged in f64 against all primitives: a tie of faces at the same place, an edge or an end met
/// within the roundings of f32, or a fault: a primitive missed, or one named that is not there. Exits with 3 on a fault.
#[derive(Args, Debug)]
pub struct CheckRaysArgs {
    /// pbrt-v4 scene file, or a ray file (.rays) with its own geometry and rays
    #[arg(required_unless_present = "terrain")]
    pub scene: Option<PathBuf>,
    /// Hills of at least so many triangles, made on the spot, with --count random rays of each kind
    #[arg(long, value_name = "N", conflicts_with = "scene", value_parser = clap::value_parser!(u32).range(1..=200_000_000))]
    pub terrain: Option<u32>,
    /// Ask only this ray, as a difference is printed: closest|any,ox,oy,oz,dx,dy,dz,tmax
    #[arg(long, value_name = "RAY", value_parser = ray, allow_hyphen_values = true)]
    pub ray: Vec<(Kind, Ray)>,
    /// Camera, bounce and shadow rays of the scene, this many each, and twice as many of a Metropolis render
    #[arg(long, value_name = "N", default_value_t = 1 << 18, value_parser = clap::value_parser!(u32).range(64..=100_000_000))]
    pub count: u32,
    /// Worker threads; one per core if not given
    #[arg(long, value_name = "N", value_parser = super::parse::threads)]
    pub threads: Option<usize>,
    /// Print JSON instead of text
    #[arg(long)]
    pub json: bool,
    /// Treat unsupported directives as warnings
    #[arg(long)]
    pub lenient: bool,
}

fn ray(text: &str) -> Result<(Kind, Ray), String> {
    let expected = || format!("found “{text}”, expected closest|any,ox,oy,oz,dx,dy,dz,tmax");
    let (kind, numbers) = text.split_once(',').ok_or_else(expected)?;
    let kind = match kind {
        "closest" => Kind::Closest,
        "any" => Kind::Any,
        _ => return Err(expected()),
    };
    let numbers: Vec<f32> = numbers
        .split(',')
        .map(|v| v.trim().parse().map_err(|_| expected()))
        .collect::<Result<_, _>>()?;
    let [ox, oy, oz, dx, dy, dz, t_max] = numbers[..] else {
        return Err(expected());
    };
    let (o, d) = (Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz));
    let ray = Ray { o, d, t_max };
    if !ray.is_fit() {
        let expected = expected();
        return Err(format!(
            "{expected}: a direction that is not 0, numbers below 1.8e18"
        ));
    }
    Ok((kind, ray))
}

/// Runs the sub-command.
pub fn run(args: &CheckRaysArgs, out: &mut dyn Write) -> Result<ExitCode, CliError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.threads.unwrap_or(0))
        .build()
        .map_err(|e| CliError::Internal(format!("cannot start threads: {e}")))?;
    let found = pool.install(|| work(args))?;
    let text = if args.json {
        serde_json::to_string_pretty(&found).expect("plain numbers")
    } else {
        let mut lines = found.lines();
        lines.insert(
            1,
            format!(
                "agreement on {:.5} % of the rays, on {:.5} % without asking again",
                100.0 * found.agreement(),
                100.0 * found.same_at_once()
            ),
        );
        lines.join("\n")
    };
    writeln!(out, "{text}").map_err(|source| {
        let path = "stdout".into();
        CliError::Output(ImageError::NotWritable { path, source })
    })?;
    Ok(ExitCode::from(if found.wrong() > 0 { 3 } else { 0 }))
}

fn work(args: &CheckRaysArgs) -> Result<Disagreement, CliError> {
    let given = |otherwise: Vec<(Kind, Ray)>| match args.ray.as_slice() {
        [] => otherwise,
        some => some.to_vec(),
    };
    let all = |sets: Vec<RaySet>| {
        let rays = |s: RaySet| s.rays.into_iter().map(move |r| (s.kind, r));
        sets.into_iter().flat_map(rays).collect()
    };
    let count = args.count as usize;
    let Some(path) = &args.scene else {
        let triangles = args.terrain.expect("clap asks for one of the two");
        let geometry = terrain::terrain(triangles as usize);
        let found = check(&geometry, |_| given(all(terrain::rays(count))))?;
        return ask_ties_again(geometry, found);
    };
    if path.extension().is_some_and(|e| e == "rays" || e == "bin") {
        let (geometry, rays) = read_rays(path)?;
        let rays: Vec<(Kind, Ray)> = rays.into_iter().map(|(r, k)| (k, r)).collect();
        let found = check(&geometry, |_| given(rays.clone()))?;
        return ask_ties_again(geometry, found);
    }
    let lenient = args.lenient;
    let scene = load_scene(
        path,
        &LoadOptions {
            lenient,
            ..LoadOptions::default()
        },
    )?;
    let found = check(&scene.geometry, |embree| {
        if args.ray.is_empty() {
            all(of_scene(&scene, embree, count))
        } else {
            args.ray.clone()
        }
    })?;
    ask_ties_again(scene.geometry, found)
}

fn check(
    geometry: &Geometry,
    rays: impl Fn(&Embree) -> Vec<(Kind, Ray)>,
) -> Result<Disagreement, CliError> {
    let embree = Embree::new(geometry, EmbreeOptions::default())?;
    let rays = rays(&embree);
    let checked = Checked::new(embree, Obvhs::new(geometry));
    rays.par_chunks(4096).for_each(|part| {
        for (kind, ray) in part {
            match kind {
                Kind::Closest => drop(checked.nearest(ray)),
                Kind::Any => drop(checked.occluded(ray)),
            }
        }
    });
    Ok(checked.disagreement())
}

/// Whether both backends find both primitives of a tie: asks those rays again of trees that can leave primitives out.
/// Embree goes other ways through such a tree, so the rest of the rays is not asked there.
fn ask_ties_again(
    mut geometry: Geometry,
    mut found: Disagreement,
) -> Result<Disagreement, CliError> {
    if found.tied.is_empty() {
        return Ok(found);
    }
    geometry.leave_out = true;
    let embree = Embree::new(&geometry, EmbreeOptions::default())?;
    let again = Checked::new(embree, Obvhs::new(&geometry));
    for ray in &found.tied {
        again.nearest(ray);
    }
    found.reversed = again.disagreement().reversed;
    Ok(found)
}
