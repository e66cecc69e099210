//! The directives of a scene file, one after the other.

use super::error::{Location, Result, SceneError};
use super::params::Params;
use super::state::{ATTRIBUTE_TARGETS, Loader};
use super::token::{Token, Tokenizer, parse_number};
use super::transform::{look_at, rotate};
use glam::{DMat4, DVec3};
use std::path::Path;

/// Files may include files, but not without end.
const MAX_DEPTH: usize = 32;

impl Loader {
    /// Reads a file and does what it says.
    pub(super) fn read_file(&mut self, path: &Path, name: &str, from: &Location) -> Result<()> {
        if self.open_files.len() >= MAX_DEPTH {
            return Err(
                SceneError::file(from, format!("{name} is included too deeply"))
                    .expected(format!("at most {MAX_DEPTH} files in each other")),
            );
        }
        if path.extension().is_some_and(|e| e == "gz") {
            let message = format!("{name}: compressed scene files are not supported");
            return Err(SceneError::unsupported(from, message));
        }
        let bytes = std::fs::read(path).map_err(|e| {
            let is_the_scene_itself = from.line == 0;
            let message = match is_the_scene_itself {
                true => format!("cannot be read: {e}"),
                false => format!("cannot read {name}: {e}"),
            };
            SceneError::file(from, message)
        })?;
        self.open_files.push(path.into());
        // Comments may be in any encoding; names that are not UTF-8 will be missed where they matter.
        let result = self.read_text(&String::from_utf8_lossy(&bytes), name);
        self.open_files.pop();
        result
    }

    /// Does what a text says.
    pub(super) fn read_text(&mut self, text: &str, name: &str) -> Result<()> {
        let mut t = Tokenizer::new(text, name.into());
        while let Some(token) = t.next()? {
            let at = t.at();
            let Token::Word(word) = token else {
                return Err(t.wrong(Some(token), "a directive"));
            };
            self.directive(word, &mut t, &at)?;
        }
        Ok(())
    }

    fn directive(&mut self, word: &str, t: &mut Tokenizer<'_>, at: &Location) -> Result<()> {
        self.check_block(word, at)?;
        match word {
            "Identity" => self.set_ctm(DMat4::IDENTITY, at, word),
            "Translate" => {
                let v = DVec3::from_array(t.numbers::<3>(word)?);
                self.concat(DMat4::from_translation(v), at, word)
            }
            "Scale" => {
                let v = DVec3::from_array(t.numbers::<3>(word)?);
                self.concat(DMat4::from_scale(v), at, word)
            }
            "Rotate" => {
                let [angle, x, y, z] = t.numbers::<4>(word)?;
                let m = rotate(angle, DVec3::new(x, y, z)).ok_or_else(|| {
                    SceneError::value(at, "Rotate has no axis")
                        .found(format!("{x} {y} {z}"))
                        .expected("a vector that is not 0")
                })?;
                self.concat(m, at, word)
            }
            "LookAt" => {
                let v = t.numbers::<9>(word)?;
                let [eye, to, up] = [0, 3, 6].map(|i| DVec3::from_slice(&v[i..i + 3]));
                let m = look_at(eye, to, up).ok_or_else(|| {
                    SceneError::value(at, "LookAt makes the transform singular")
                        .found(format!("eye {eye}, target {to}, up {up}"))
                        .expected("a target away from the eye and not in the direction of up")
                })?;
                self.concat(m, at, word)
            }
            "Transform" => self.set_ctm(DMat4::from_cols_array(&t.numbers::<16>(word)?), at, word),
            "ConcatTransform" => {
                self.concat(DMat4::from_cols_array(&t.numbers::<16>(word)?), at, word)
            }
            "CoordinateSystem" => {
                let name = t.string("a name")?;
                self.coordinate_systems.insert(name, self.gs.ctm);
                Ok(())
            }
            "CoordSysTransform" => self.named_transform(t),
            "ReverseOrientation" => {
                self.gs.reverse = !self.gs.reverse;
                Ok(())
            }
            "ActiveTransform" => self.active_transform(t, at),
            "TransformTimes" => t.numbers::<2>(word).map(|_| ()),
            // pbrt-v4 treats the old Transform blocks as Attribute blocks.
            "AttributeBegin" | "TransformBegin" => {
                self.push("AttributeBegin", at);
                Ok(())
            }
            "AttributeEnd" | "TransformEnd" => self.pop("AttributeBegin", word, at),
            "WorldBegin" => self.world_begin(at),
            "ColorSpace" => {
                let name = t.string("a colour space")?;
                if name == "srgb" {
                    return Ok(());
                }
                let e = SceneError::unsupported(at, "this colour space is not supported")
                    .found(format!("\"{name}\""))
                    .expected("\"srgb\"");
                self.complain(vec![e])
            }
            // Options steer pbrt itself.
            "Option" => Params::parse(t, word.into(), at.clone()).map(|_| ()),
            "Attribute" => self.attribute(t, at),
            "Include" => {
                let name = t.string("a file name")?;
                let path = self.library.files.resolve(&name);
                self.read_file(&path, &path.display().to_string(), &t.at())
            }
            "Import" => {
                let name = t.string("a file name")?;
                let path = self.library.files.resolve(&name);
                let (saved, depth) = (self.gs.clone(), self.stack.len());
                self.read_file(&path, &path.display().to_string(), &t.at())?;
                self.balanced(depth)?;
                self.gs = saved;
                Ok(())
            }
            _ => self.scene_directive(word, t, at),
        }
    }

    /// Some directives belong before `WorldBegin`, some after it.
    fn check_block(&self, word: &str, at: &Location) -> Result<()> {
        let (prelude, world): (&[&str], &[&str]) = (
            &[
                "Camera",
                "Film",
                "PixelFilter",
                "Sampler",
                "Integrator",
                "Accelerator",
                "Option",
                "ColorSpace",
            ],
            &[
                "AttributeBegin",
                "AttributeEnd",
                "ReverseOrientation",
                "Attribute",
                "ObjectBegin",
                "ObjectEnd",
                "ObjectInstance",
                "Shape",
                "LightSource",
                "AreaLightSource",
                "Material",
                "NamedMaterial",
                "MakeNamedMaterial",
                "Texture",
                "Import",
            ],
        );
        // A colour space may change inside the world as well.
        let misplaced = if self.in_world {
            word != "ColorSpace" && prelude.contains(&word)
        } else {
            word != "Attribute" && world.contains(&word)
        };
        if !misplaced {
            return Ok(());
        }
        let side = if self.in_world { "before" } else { "after" };
        Err(
            SceneError::syntax(at, format!("{word} stands on the wrong side of WorldBegin"))
                .expected(format!("it {side} WorldBegin")),
        )
    }

    fn named_transform(&mut self, t: &mut Tokenizer<'_>) -> Result<()> {
        let name = t.string("a name")?;
        let Some(m) = self.coordinate_systems.get(&name).copied() else {
            return Err(SceneError::value(&t.at(), "unknown coordinate system")
                .found(format!("\"{name}\""))
                .expected("a name given to CoordinateSystem above, \"camera\" or \"world\""));
        };
        self.set_ctm(m, &t.at(), "CoordSysTransform")
    }

    fn active_transform(&mut self, t: &mut Tokenizer<'_>, at: &Location) -> Result<()> {
        let which = match t.next()? {
            Some(Token::Word(w @ ("All" | "StartTime" | "EndTime"))) => w,
            other => return Err(t.wrong(other, "All, StartTime or EndTime")),
        };
        if which != "All" {
            let e = SceneError::unsupported(at, "motion is not supported")
                .found(format!("ActiveTransform {which}"));
            self.complain(vec![e])?;
        }
        // A lenient reader keeps the scene as it is when the shutter opens.
        self.gs.start_active = which != "EndTime";
        Ok(())
    }

    pub(super) fn push(&mut self, by: &'static str, at: &Location) {
        self.stack.push((by, at.clone(), self.gs.clone()));
    }

    pub(super) fn pop(&mut self, begin: &'static str, end: &str, at: &Location) -> Result<()> {
        match self.stack.pop() {
            Some((by, _, gs)) if by == begin => {
                self.gs = gs;
                Ok(())
            }
            Some((by, opened, _)) => Err(SceneError::syntax(
                at,
                format!("{end} inside another block"),
            )
            .found(format!("{by} at {opened} still open"))),
            None => Err(SceneError::syntax(at, format!("{end} without {begin}"))),
        }
    }

    /// Nothing has been opened since the stack had this depth.
    pub(super) fn balanced(&self, depth: usize) -> Result<()> {
        match self.stack.get(depth) {
            Some((by, opened, _)) => {
                let end = by.replace("Begin", "End");
                Err(SceneError::syntax(opened, format!("{by} without {end}")))
            }
            None => Ok(()),
        }
    }

    fn world_begin(&mut self, at: &Location) -> Result<()> {
        if self.in_world {
            return Err(SceneError::syntax(at, "a second WorldBegin"));
        }
        self.in_world = true;
        self.gs.start_active = true;
        self.gs.ctm = DMat4::IDENTITY;
        self.coordinate_systems
            .insert("world".into(), DMat4::IDENTITY);
        Ok(())
    }

    fn attribute(&mut self, t: &mut Tokenizer<'_>, at: &Location) -> Result<()> {
        let target = t.string("a target")?;
        let Some(i) = ATTRIBUTE_TARGETS.iter().position(|k| *k == target) else {
            return Err(SceneError::value(&t.at(), "unknown target of Attribute")
                .found(format!("\"{target}\""))
                .expected("\"shape\", \"light\", \"material\", \"medium\" or \"texture\""));
        };
        let params = Params::parse(t, format!("Attribute \"{target}\""), at.clone())?;
        // The latest setting of a name counts.
        self.gs.defaults[i].splice(0..0, params.own);
        Ok(())
    }

    /// Steps over a directive that is not known.
    pub(super) fn skip(&mut self, word: &str, t: &mut Tokenizer<'_>, at: &Location) -> Result<()> {
        let e = SceneError::unsupported(at, "unknown directive").found(format!("{word:.40}"));
        self.complain(vec![e])?;
        while let Some(b) = t.peek() {
            if b.is_ascii_alphabetic() && !t.at_truth_value() {
                break;
            }
            if let Some(Token::Word(w)) = t.next()?
                && parse_number(w).is_none()
                && !matches!(w, "true" | "false")
            {
                return Err(t.wrong(Some(Token::Word(w)), "a directive"));
            }
        }
        Ok(())
    }
}
