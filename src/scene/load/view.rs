//! `Camera` and `Film`.

use super::error::{Location, Result, SceneError};
use super::params::Params;
use super::state::{Loader, Pending};
use crate::scene::Camera;
use glam::{DMat3, DMat4, DVec3, Mat3, Vec3};

/// The image a `Film` directive describes.
pub(super) struct Film {
    pub(super) resolution: [u32; 2],
    pub(super) crop: [u32; 4],
    pub(super) filename: Option<String>,
    /// iso / 100, without the exposure time.
    pub(super) gain: f64,
}

/// Film parameters that choose the file's form, not the image: the output options decide these here.
const FILM: [&str; 7] = [
    "savefp16",
    "diagonal",
    "coordinatesystem",
    "nbuckets",
    "lambdamin",
    "lambdamax",
    "filename",
];

impl Loader {
    /// Reads the film; pbrt's defaults without a directive.
    pub(super) fn film(&mut self) -> Result<Film> {
        let (kind, p) = directive(self.prelude.film.take(), "rgb", "Film");
        if !matches!(kind.as_str(), "rgb" | "gbuffer" | "spectral") {
            let e = SceneError::unsupported(&p.at, "this film is not supported")
                .found(format!("\"{kind}\""))
                .expected("\"rgb\", \"gbuffer\" or \"spectral\"");
            self.complain(vec![e])?;
        }
        // 2¹⁶ a side: the raster domain must stay exact in f32.
        let size = |name, d| p.integer(name, d, 1..=1 << 16).map(|v| v as u32);
        let resolution = [size("xresolution", 1280)?, size("yresolution", 720)?];
        let crop = crop(&p, resolution)?;
        let gain = p.float_where("iso", 100.0, "an ISO above 0", |v| v > 0.0)? / 100.0;
        let mut refused = Vec::new();
        if p.string("sensor", "cie1931")? != "cie1931" {
            refused.push(("sensor", "only the sensor \"cie1931\" is supported"));
        }
        if p.float("whitebalance", 0.0)? != 0.0 {
            refused.push(("whitebalance", "white balance is not supported"));
        }
        if let Some(q) = p.get("maxcomponentvalue")
            && q.numbers().iter().any(|v| v.is_finite())
        {
            refused.push(("maxcomponentvalue", "clamping of samples is not supported"));
        }
        for (name, message) in refused {
            let at = p.get(name).map_or(&p.at, |q| &q.at);
            self.complain(vec![SceneError::unsupported(at, message)])?;
        }
        let filename = p.string_opt("filename")?.map(String::from);
        self.complain(p.unused(&FILM))?;
        Ok(Film {
            resolution,
            crop,
            filename,
            gain,
        })
    }

    /// Reads the camera, its position in true world coordinates apart, and the exposure time.
    pub(super) fn camera(&mut self, film: &Film) -> Result<(Camera, DVec3, f64)> {
        let (pending, ctm) = match self.prelude.camera.take() {
            Some((c, ctm)) => (Some(c), ctm),
            None => (None, DMat4::IDENTITY),
        };
        let (kind, p) = directive(pending, "perspective", "Camera");
        if kind != "perspective" {
            return Err(
                SceneError::unsupported(&p.at, "this camera is not supported")
                    .found(format!("\"{kind}\""))
                    .expected("\"perspective\""),
            );
        }
        let [w, h] = film.resolution.map(f64::from);
        let aspect = p.float_where("frameaspectratio", w / h, "a ratio above 0", |v| v > 0.0)?;
        // The shorter side spans −1 … 1, and the field of view.
        let default = if aspect > 1.0 {
            [-aspect, aspect, -1.0, 1.0]
        } else {
            [-1.0, 1.0, -1.0 / aspect, 1.0 / aspect]
        };
        let window = p.floats::<4>("screenwindow")?.unwrap_or(default);
        if window[0] == window[1] || window[2] == window[3] {
            return Err(p.bad("screenwindow").expected("a window that is not empty"));
        }
        let fov = p.float_where("fov", 90.0, "an angle between 0 and 180 degrees", |v| {
            v > 0.0 && v < 180.0
        })?;
        let half = (fov / 2.0).to_radians().tan();
        let frame = Frame::new(&ctm.inverse());
        if frame.sheared {
            self.warn(
                &p.at,
                "the camera's transform shears; the shear is left out",
            );
        }
        let s = frame.scale;
        // A scaled camera space stretches the window on z = 1, the lens and the distance in focus.
        let screen = [
            window[0] * half * s.x / s.z,
            window[1] * half * s.x / s.z,
            window[2] * half * s.y / s.z,
            window[3] * half * s.y / s.z,
        ];
        let lens = p.float_where("lensradius", 0.0, "no negative radius", |v| v >= 0.0)?;
        let focus = p.float_where("focaldistance", 1e6, "a distance above 0", |v| v > 0.0)?;
        if lens > 0.0 && (s.x - s.y).abs() > 1e-5 * s.x {
            self.warn(
                &p.at,
                "the camera's transform makes the lens an ellipse; it is kept round",
            );
        }
        let (open, close) = (p.float("shutteropen", 0.0)?, p.float("shutterclose", 1.0)?);
        if close <= open {
            return Err(p
                .bad("shutterclose")
                .found(close)
                .expected(format!("later than {open}")));
        }
        self.complain(p.unused(&[]))?;
        self.sources.camera = Some(super::state::source("camera \"perspective\"", &p.at));
        let camera = Camera {
            position: Vec3::ZERO,
            axes: frame.axes,
            resolution: film.resolution,
            crop: film.crop,
            screen: screen.map(|v| v as f32),
            lens_radius: (lens * s.x) as f32,
            focal_distance: (focus * s.z) as f32,
        };
        Ok((camera, frame.position, close - open))
    }
}

fn crop(p: &Params, [w, h]: [u32; 2]) -> Result<[u32; 4]> {
    let full = [0, w, 0, h].map(i64::from);
    let [x0, x1, y0, y1] = if let Some(b) = p.integers("pixelbounds")? {
        let [a, b, c, d] = b[..] else {
            return Err(p
                .bad("pixelbounds")
                .found(format!("{} numbers", b.len()))
                .expected("4: x0 x1 y0 y1"));
        };
        [a.max(0), b.min(full[1]), c.max(0), d.min(full[3])]
    } else if let Some(c) = p.floats::<4>("cropwindow")? {
        let c = c.map(|v| v.clamp(0.0, 1.0));
        let at = |v: f64, n: u32| (f64::from(n) * v).ceil() as i64;
        [
            at(c[0].min(c[1]), w),
            at(c[0].max(c[1]), w),
            at(c[2].min(c[3]), h),
            at(c[2].max(c[3]), h),
        ]
    } else {
        full
    };
    if x0 >= x1 || y0 >= y1 {
        return Err(SceneError::value(&p.at, "the film's crop holds no pixel")
            .found(format!("x {x0} to {x1}, y {y0} to {y1}")));
    }
    Ok([x0, y0, x1, y1].map(|v| v as u32))
}

/// A camera's frame, taken apart into unit axes and their scale.
struct Frame {
    position: DVec3,
    axes: Mat3,
    scale: DVec3,
    sheared: bool,
}

impl Frame {
    fn new(to_world: &DMat4) -> Self {
        let m = DMat3::from_mat4(*to_world);
        let scale = DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
        let z = m.z_axis / scale.z;
        let y = m.y_axis / scale.y;
        let x = m.x_axis / scale.x;
        // Scene files carry 6 digits or more.
        let sheared = x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs()) > 1e-4;
        let y = (y - z * z.dot(y)).normalize();
        let mirrored = m.determinant() < 0.0;
        let x = y.cross(z) * if mirrored { -1.0 } else { 1.0 };
        Self {
            position: to_world.w_axis.truncate(),
            axes: DMat3::from_cols(x, y, z).as_mat3(),
            scale,
            sheared,
        }
    }
}

/// A directive's kind and parameters, or the default kind without any.
pub(super) fn directive(pending: Option<Pending>, default: &str, name: &str) -> (String, Params) {
    match pending {
        Some(d) => (d.kind, d.params),
        None => {
            let at = Location {
                file: "default".into(),
                line: 0,
                column: 0,
            };
            (default.into(), Params::empty(name, &at))
        }
    }
}
