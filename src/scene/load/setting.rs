//! Changes to a scene beside its file: parameters of a directive, or the place of the camera. They are written as in a
//! scene file, so that every parameter that a file may have can be set.

use super::error::{Location, Result, SceneError};
use super::params::Params;
use super::token::{Token, Tokenizer, parse_number};
use std::rc::Rc;

/// What can be set, with a name or number behind it where there may be several.
const TARGETS: [(&str, &str); 10] = [
    ("view", ""),
    ("camera", ""),
    ("film", ""),
    ("filter", ""),
    ("sampler", ""),
    ("integrator", ""),
    ("material", "NAME"),
    ("texture", "NAME"),
    ("light", "NUMBER"),
    ("arealight", "NUMBER"),
];

/// Directives that `view` may have.
const TRANSFORMS: [&str; 7] = [
    "Identity",
    "Translate",
    "Scale",
    "Rotate",
    "LookAt",
    "Transform",
    "ConcatTransform",
];

/// A change to a scene.
///
/// `camera="float fov" 30` replaces or adds a parameter of the Camera directive; `material glass=…` those of
/// `MakeNamedMaterial "glass"`, and so with textures; `light 2=…` those of the second LightSource, `arealight 2=…` those
/// of the second AreaLightSource. `view=LookAt …` stands in the place of all transforms before Camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    target: String,
    text: String,
}

impl Setting {
    /// Reads `TARGET=TEXT`.
    ///
    /// # Errors
    /// A target that there is not, or text that no scene file may have there.
    pub fn parse(word: &str) -> std::result::Result<Self, String> {
        let (target, text) = word
            .split_once('=')
            .ok_or("expected TARGET=TEXT, such as 'camera=\"float fov\" 30'")?;
        Self::new(target, text)
    }

    /// From target and text.
    ///
    /// # Errors
    /// As [`Self::parse`].
    pub fn new(target: &str, text: &str) -> std::result::Result<Self, String> {
        let (word, name) = target.trim().split_once(' ').unwrap_or((target.trim(), ""));
        let name = name.trim();
        let known = TARGETS.iter().find(|t| t.0 == word);
        let wrong = |expected: &str| Err(format!("cannot set “{target}”: expected {expected}"));
        match known {
            Some((_, "")) if name.is_empty() => {}
            Some((_, "NAME")) if !name.is_empty() => {}
            Some((_, "NUMBER")) if name.parse::<u32>().is_ok_and(|n| n > 0) => {}
            Some((word, "")) => return wrong(word),
            Some((word, what)) => return wrong(&format!("{word} {what}")),
            None => {
                let all = TARGETS.map(|(word, what)| format!("{word} {what}").trim().to_owned());
                return wrong(&format!("one of {}", all.join(", ")));
            }
        }
        let setting = Self {
            target: format!("{word} {name}").trim().to_owned(),
            text: text.to_owned(),
        };
        let checked = match word {
            "view" => setting.transforms(),
            _ => setting.params().map(drop),
        };
        checked.map(|()| setting).map_err(|e| e.to_string())
    }

    /// What is set, as it was written.
    pub fn target(&self) -> &str {
        &self.target
    }

    /// What it is set to, as it was written.
    pub fn text(&self) -> &str {
        &self.text
    }

    fn file(&self) -> String {
        format!("--set {}", self.target)
    }

    fn tokens(&self) -> Tokenizer<'_> {
        Tokenizer::new(&self.text, self.file().into())
    }

    fn params(&self) -> Result<Params> {
        let mut t = self.tokens();
        let at = Location {
            file: self.file().into(),
            line: 0,
            column: 0,
        };
        let params = Params::parse(&mut t, self.target.clone(), at)?;
        match t.next()? {
            None if !params.own.is_empty() => Ok(params),
            other => Err(t.wrong(other, "a parameter, such as \"float fov\" 30")),
        }
    }

    /// That there are transforms and nothing else.
    fn transforms(&self) -> Result<()> {
        let mut t = self.tokens();
        let mut some = false;
        while let Some(token) = t.next()? {
            match token {
                Token::Word(w) if TRANSFORMS.contains(&w) => some = true,
                Token::Word(w) if some && parse_number(w).is_some() => {}
                Token::Open | Token::Close if some => {}
                other => return Err(t.wrong(Some(other), format!("one of {TRANSFORMS:?}"))),
            }
        }
        if some {
            Ok(())
        } else {
            Err(t.wrong(None, format!("one of {TRANSFORMS:?}")))
        }
    }
}

/// The changes to the scene that is being read, and which of them have been made.
#[derive(Default)]
pub(super) struct Settings {
    list: Vec<(Setting, bool)>,
    /// LightSource and AreaLightSource directives so far.
    pub(super) lights: [u32; 2],
}

impl Settings {
    pub(super) fn new(all: &[Setting]) -> Self {
        Self {
            list: all.iter().map(|s| (s.clone(), false)).collect(),
            lights: [0; 2],
        }
    }

    /// Sets parameters of the directive that is this target.
    pub(super) fn apply(&mut self, target: &str, params: &mut Params) -> Result<()> {
        for (setting, used) in self.list.iter_mut().filter(|s| s.0.target == target) {
            *used = true;
            for p in setting.params()?.own {
                match params.own.iter_mut().find(|q| q.name == p.name) {
                    Some(old) => *old = p,
                    None => params.own.push(Rc::clone(&p)),
                }
            }
        }
        Ok(())
    }

    /// Sets parameters of the next LightSource (0) or AreaLightSource (1).
    pub(super) fn apply_to_light(&mut self, kind: usize, params: &mut Params) -> Result<()> {
        self.lights[kind] += 1;
        let word = ["light", "arealight"][kind];
        self.apply(&format!("{word} {}", self.lights[kind]), params)
    }

    /// The text that stands for the transforms before Camera, and its name.
    pub(super) fn view(&mut self) -> Option<(String, String)> {
        let views = self.list.iter_mut().filter(|s| s.0.target == "view");
        let (setting, used) = views.last()?;
        *used = true;
        Some((setting.text.clone(), setting.file()))
    }

    /// The first change that found nothing to change.
    pub(super) fn unused(&self) -> Option<SceneError> {
        let (setting, _) = self.list.iter().find(|s| !s.1)?;
        let at = Location {
            file: setting.file().into(),
            line: 0,
            column: 0,
        };
        let e = SceneError::value(&at, "there is no such directive in the scene");
        let kinds = ["light", "arealight"];
        let word = setting.target.split(' ').next().unwrap_or_default();
        Some(match kinds.iter().position(|k| *k == word) {
            Some(k) => e.expected(format!("a number from 1 to {}", self.lights[k])),
            None => e,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{LoadOptions, load_str};
    use super::*;
    use crate::scene::Scene;
    use std::path::Path;

    fn scene(middle: &str, set: &[&str]) -> std::result::Result<Scene, SceneError> {
        let text = format!(
            "{middle}\nWorldBegin\nMakeNamedMaterial \"glass\" \"string type\" \"dielectric\" \"float eta\" 1.5\n\
             NamedMaterial \"glass\"\nLightSource \"point\" \"rgb I\" [1 1 1]\nShape \"sphere\"\n"
        );
        let settings = set.iter().map(|s| Setting::parse(s).expect("fit"));
        let options = LoadOptions {
            settings: settings.collect(),
            ..LoadOptions::default()
        };
        load_str(&text, Path::new(""), &options)
    }

    /// A scene with settings is the scene whose file says the same.
    #[test]
    fn settings_are_what_the_file_would_say() {
        let file = "Film \"rgb\" \"integer xresolution\" 8\nLookAt 1 2 -9 0 0 0 0 1 0\nCamera \"perspective\"";
        let plain = scene(file, &[]).expect("a scene");
        for (set, same) in [
            (
                "camera=\"float fov\" 30",
                "Camera \"perspective\" \"float fov\" 30",
            ),
            ("film=\"integer xresolution\" 9", ""),
            ("view=LookAt 3 2 -9  0 0 0  0 1 0 Rotate 30 0 1 0", ""),
        ] {
            let there = match set.split('=').next() {
                Some("camera") => file.replace("Camera \"perspective\"", same),
                Some("film") => file.replace("xresolution\" 8", "xresolution\" 9"),
                _ => file.replace("LookAt 1 2 -9 0 0 0 0 1 0", &set["view=".len()..]),
            };
            let a = scene(file, &[set]).expect("a scene");
            let b = scene(&there, &[]).expect("a scene");
            assert_eq!((a.hash, &a.camera), (b.hash, &b.camera), "{set}");
            assert_ne!(a.hash, plain.hash, "{set}");
        }
        let glass = scene(file, &["material glass=\"float eta\" 1.5"]).expect("a scene");
        assert_eq!(glass.hash, plain.hash);
        for set in [
            "material glass=\"float eta\" 1.33",
            "light 1=\"rgb I\" [2 1 1] \"float scale\" 2",
        ] {
            assert_ne!(
                scene(file, &[set]).expect("a scene").hash,
                plain.hash,
                "{set}"
            );
        }
    }

    #[test]
    fn mistakes_are_told_with_their_place() {
        let file = "Camera \"perspective\"";
        for (set, says) in [
            (
                "material ice=\"float eta\" 1.3",
                "--set material ice: there is no such",
            ),
            ("light 2=\"float scale\" 2", "a number from 1 to 1"),
            (
                "camera=\"float fog\" 3",
                "--set camera:1:1: Camera \"perspective\" does not take",
            ),
            ("camera=\"float fov\" 300", "--set camera:1:1"),
        ] {
            let e = scene(file, &[set]).expect_err(set).to_string();
            assert!(e.contains(says), "{set}: {e}");
        }
        for (word, says) in [
            ("camera", "TARGET=TEXT"),
            ("lens=\"float fov\" 3", "one of view, camera, film"),
            ("material=\"float eta\" 3", "material NAME"),
            ("light x=\"float scale\" 3", "light NUMBER"),
            ("camera=fov 3", "--set camera:1:1"),
            ("camera=", "a parameter"),
            ("camera=\"float fov\" wide", "--set camera:1:13"),
            ("view=Shape \"sphere\"", "--set view:1:1"),
            ("view=", "LookAt"),
        ] {
            let e = Setting::parse(word).expect_err(word);
            assert!(e.contains(says), "{word}: {e}");
        }
    }
}
