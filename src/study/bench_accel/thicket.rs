//! A scene of any number of instances, made on the spot: bumpy balls on a floor, each turned and stretched its own way.

use crate::sampling::Rng;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::str::FromStr;

/// Stage of the random streams, apart from those of a render.
const STAGE: u32 = 102;

/// How many, how fine and how close.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thicket {
    /// Places in which the ball stands.
    pub places: u32,
    /// Rings of its faces: 4·rings·(rings − 1) triangles.
    pub rings: u32,
    /// Distance of neighbouring places over the ball's diameter, about.
    pub gap: f64,
}

impl FromStr for Thicket {
    type Err = String;

    fn from_str(s: &str) -> Result<Self, String> {
        let bad = || format!("found “{s}”, expected PLACES,RINGS,GAP as in 1000,50,0.8");
        let [places, rings, gap] = s.split(',').collect::<Vec<_>>()[..] else {
            return Err(bad());
        };
        let places = places.parse().ok().filter(|n| (1..=10_000_000).contains(n));
        let rings = rings.parse().ok().filter(|n| (2..=2000).contains(n));
        let gap = gap.parse().ok().filter(|g| (1e-3..=1e3).contains(g));
        let (places, rings, gap) = (places.zip(rings).zip(gap))
            .map(|((p, r), g)| (p, r, g))
            .ok_or_else(bad)?;
        Ok(Self { places, rings, gap })
    }
}

impl std::fmt::Display for Thicket {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{},{},{}", self.places, self.rings, self.gap)
    }
}

impl Thicket {
    /// The scene as pbrt text.
    pub fn text(&self) -> String {
        let side = f64::from(self.places).sqrt().ceil() as u32;
        let far = f64::from(side) * self.gap;
        let mut t = format!(
            r#"Integrator "mlt" "integer maxdepth" 5
Film "rgb" "integer xresolution" 256 "integer yresolution" 192
LookAt {} {} 12  {} {} 0  0 0 1
Camera "perspective" "float fov" 50
WorldBegin
LightSource "infinite" "rgb L" [ 0.4 0.45 0.6 ]
LightSource "distant" "point3 from" [ 1 -1 2 ] "point3 to" [ 0 0 0 ] "rgb L" [ 2 2 1.8 ]
Material "diffuse" "rgb reflectance" [ 0.4 0.35 0.3 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
  "point3 P" [ -100 -100 -0.5  {far} -100 -0.5  {far} {far} -0.5  -100 {far} -0.5 ]
Material "diffuse" "rgb reflectance" [ 0.3 0.5 0.2 ]
ObjectBegin "ball"
Shape "trianglemesh" "#,
            -0.15 * far,
            -0.2 * far,
            0.4 * far,
            0.4 * far,
            far = far + 100.0,
        );
        self.ball(&mut t);
        t += "ObjectEnd\n";
        for i in 0..self.places {
            let mut rng = Rng::new(1, STAGE, i, 0);
            let mut between = |lo: f64, hi: f64| lo + (hi - lo) * f64::from(rng.next_f32());
            let x = self.gap * (f64::from(i % side) + between(0.0, 0.6));
            let y = self.gap * (f64::from(i / side) + between(0.0, 0.6));
            let z = between(0.0, 0.3);
            let axis = [(); 3].map(|()| between(-0.5, 0.5));
            let angle = between(0.0, 360.0);
            let scale = [(); 3].map(|()| between(0.7, 1.3));
            let _ = writeln!(
                t,
                "AttributeBegin Translate {x} {y} {z} Rotate {angle} {} {} {} Scale {} {} {} ObjectInstance \"ball\" AttributeEnd",
                axis[0], axis[1], axis[2], scale[0], scale[1], scale[2]
            );
        }
        t
    }

    /// Its corners and faces: rings of 2·rings corners, all of the first and last at the poles.
    fn ball(&self, t: &mut String) {
        let (rows, cols) = (self.rings, 2 * self.rings);
        *t += "\"point3 P\" [";
        for i in 0..=rows {
            for j in 0..cols {
                let theta = PI * f64::from(i) / f64::from(rows);
                let phi = TAU * f64::from(j) / f64::from(cols);
                let bumps = 0.15 * (7.0 * theta).sin() * (5.0 * phi).cos();
                let r = 0.4 * (1.0 + bumps + 0.05 * (23.0 * phi).sin() * (19.0 * theta).sin());
                let [x, y] = [phi.cos(), phi.sin()].map(|c| r * theta.sin() * c);
                let _ = write!(t, " {x:.6} {y:.6} {:.6}", r * theta.cos());
            }
        }
        *t += " ] \"integer indices\" [";
        for i in 0..rows {
            for j in 0..cols {
                let (a, b) = (i * cols + j, i * cols + (j + 1) % cols);
                let (c, d) = (a + cols, b + cols);
                if i > 0 {
                    let _ = write!(t, " {a} {c} {b}");
                }
                if i + 1 < rows {
                    let _ = write!(t, " {b} {c} {d}");
                }
            }
        }
        *t += " ]\n";
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load::{LoadOptions, load_str};
    use std::path::Path;

    #[test]
    fn a_thicket_is_as_large_as_it_says() {
        let thicket: Thicket = "30,5,0.8".parse().expect("a thicket");
        assert_eq!(thicket.to_string().parse(), Ok(thicket));
        let scene = load_str(&thicket.text(), Path::new(""), &LoadOptions::default());
        let g = scene.unwrap_or_else(|e| panic!("{e}")).geometry;
        assert_eq!((g.instances.len(), g.objects.len()), (30, 1));
        assert_eq!(g.objects[0].triangles.len(), 4 * 5 * 4);
        for bad in ["", "1,2", "0,5,1", "1,1,1", "1,2,0", "1,2,x", "1,2,3,4"] {
            assert!(bad.parse::<Thicket>().is_err(), "{bad}");
        }
    }
}
