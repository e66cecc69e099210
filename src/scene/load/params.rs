//! Parameter lists: `"type name" values`, typed, each remembering whether anybody asked for it.

use super::error::{Location, Result, SceneError};
use super::token::{Token, Tokenizer, parse_number};
use std::cell::Cell;
use std::rc::Rc;

/// pbrt's parameter types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Type {
    Integer,
    Float,
    Bool,
    String,
    Point2,
    Point3,
    Vector2,
    Vector3,
    Normal,
    Rgb,
    Blackbody,
    Spectrum,
    Texture,
}

impl Type {
    fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "integer" => Self::Integer,
            "float" => Self::Float,
            "bool" => Self::Bool,
            "string" => Self::String,
            "point2" => Self::Point2,
            // The forms without a digit are pbrt-v3's; they occur in converted scenes.
            "point3" | "point" => Self::Point3,
            "vector2" => Self::Vector2,
            "vector3" | "vector" => Self::Vector3,
            "normal" | "normal3" => Self::Normal,
            "rgb" | "color" => Self::Rgb,
            "blackbody" => Self::Blackbody,
            "spectrum" => Self::Spectrum,
            "texture" => Self::Texture,
            _ => return None,
        })
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Integer => "integer",
            Self::Float => "float",
            Self::Bool => "bool",
            Self::String => "string",
            Self::Point2 => "point2",
            Self::Point3 => "point3",
            Self::Vector2 => "vector2",
            Self::Vector3 => "vector3",
            Self::Normal => "normal",
            Self::Rgb => "rgb",
            Self::Blackbody => "blackbody",
            Self::Spectrum => "spectrum",
            Self::Texture => "texture",
        }
    }

    /// Numbers to one value; `None` where the values are not numbers.
    pub(super) fn arity(self) -> Option<usize> {
        match self {
            Self::Integer | Self::Float | Self::Blackbody | Self::Spectrum => Some(1),
            Self::Point2 | Self::Vector2 => Some(2),
            Self::Point3 | Self::Vector3 | Self::Normal | Self::Rgb => Some(3),
            Self::Bool | Self::String | Self::Texture => None,
        }
    }
}

/// The values of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Values {
    Numbers(Vec<f64>),
    Strings(Vec<String>),
    Bools(Vec<bool>),
}

/// One parameter.
#[derive(Debug)]
pub(super) struct Param {
    pub(super) ty: Type,
    pub(super) name: String,
    pub(super) at: Location,
    pub(super) values: Values,
    pub(super) used: Cell<bool>,
}

impl Param {
    pub(super) fn numbers(&self) -> &[f64] {
        match &self.values {
            Values::Numbers(v) => v,
            _ => &[],
        }
    }

    pub(super) fn strings(&self) -> &[String] {
        match &self.values {
            Values::Strings(v) => v,
            _ => &[],
        }
    }
}

/// A parameter list. Parameters of an `Attribute` directive follow the shape's own and may stay unused.
#[derive(Clone, Debug)]
pub(super) struct Params {
    /// The directive, for messages.
    pub(super) owner: String,
    /// Where the directive stands.
    pub(super) at: Location,
    pub(super) own: Vec<Rc<Param>>,
    pub(super) defaults: Vec<Rc<Param>>,
}

impl Params {
    /// Reads parameters up to the next directive.
    pub(super) fn parse(t: &mut Tokenizer<'_>, owner: String, at: Location) -> Result<Self> {
        let mut own: Vec<Rc<Param>> = Vec::new();
        while t.peek() == Some(b'"') {
            let p = parse_one(t)?;
            if let Some(first) = own.iter().find(|q| q.name == p.name) {
                let message = format!("parameter \"{}\" is given twice", p.name);
                return Err(
                    SceneError::value(&p.at, message).found(format!("the first at {}", first.at))
                );
            }
            own.push(Rc::new(p));
        }
        Ok(Self {
            owner,
            at,
            own,
            defaults: Vec::new(),
        })
    }

    /// An empty list.
    pub(super) fn empty(owner: &str, at: &Location) -> Self {
        Self {
            owner: owner.into(),
            at: at.clone(),
            own: Vec::new(),
            defaults: Vec::new(),
        }
    }

    /// The parameter of that name, marked as used.
    pub(super) fn get(&self, name: &str) -> Option<&Rc<Param>> {
        let p = self
            .own
            .iter()
            .chain(&self.defaults)
            .find(|p| p.name == name)?;
        p.used.set(true);
        Some(p)
    }

    /// The first parameter nobody asked for and that is not in `harmless`, as an error.
    pub(super) fn unused(&self, harmless: &[&str]) -> Vec<SceneError> {
        self.own
            .iter()
            .filter(|p| !p.used.get() && !harmless.contains(&p.name.as_str()))
            .map(|p| {
                let message = format!(
                    "{} does not take the parameter \"{} {}\"",
                    self.owner,
                    p.ty.name(),
                    p.name
                );
                SceneError::unsupported(&p.at, message)
            })
            .collect()
    }
}

fn parse_one(t: &mut Tokenizer<'_>) -> Result<Param> {
    let declaration = t.string("a parameter \"type name\"")?;
    let at = t.at();
    let mut words = declaration.split_ascii_whitespace();
    let (Some(ty_name), Some(name), None) = (words.next(), words.next(), words.next()) else {
        return Err(SceneError::syntax(&at, "a parameter is not declared")
            .found(format!("\"{declaration}\""))
            .expected("\"type name\""));
    };
    let Some(ty) = Type::from_name(ty_name) else {
        return Err(SceneError::syntax(&at, "unknown parameter type")
            .found(ty_name)
            .expected(
                "integer, float, bool, string, point2, point3, vector2, vector3, normal, rgb, \
                 blackbody, spectrum or texture",
            ));
    };
    let bracket = t.peek() == Some(b'[');
    if bracket {
        t.next()?;
    }
    let mut values: Option<Values> = None;
    loop {
        let token = t.next()?;
        match token {
            Some(Token::Close) if bracket => break,
            Some(Token::Quoted(s)) => match values.get_or_insert(Values::Strings(Vec::new())) {
                Values::Strings(v) => v.push(s.into_owned()),
                _ => return Err(mixed(t, &declaration, Token::Quoted(s))),
            },
            Some(Token::Word(w @ ("true" | "false"))) => {
                match values.get_or_insert(Values::Bools(Vec::new())) {
                    Values::Bools(v) => v.push(w == "true"),
                    _ => return Err(mixed(t, &declaration, Token::Word(w))),
                }
            }
            Some(Token::Word(w)) => {
                let Some(x) = parse_number(w) else {
                    let what = format!("a value of \"{declaration}\"");
                    return Err(t.wrong(Some(Token::Word(w)), what));
                };
                match values.get_or_insert(Values::Numbers(Vec::new())) {
                    Values::Numbers(v) => v.push(x),
                    _ => return Err(mixed(t, &declaration, Token::Word(w))),
                }
            }
            other => return Err(t.wrong(other, format!("a value of \"{declaration}\""))),
        }
        if !bracket {
            break;
        }
    }
    let values = values.unwrap_or(match ty {
        Type::Bool => Values::Bools(Vec::new()),
        Type::String | Type::Texture => Values::Strings(Vec::new()),
        _ => Values::Numbers(Vec::new()),
    });
    let param = Param {
        ty,
        name: name.into(),
        at,
        values,
        used: Cell::new(false),
    };
    check(param)
}

fn mixed(t: &Tokenizer<'_>, declaration: &str, token: Token<'_>) -> SceneError {
    SceneError::syntax(
        &t.at(),
        format!("the values of \"{declaration}\" are not all of one kind"),
    )
    .found(token.describe())
}

/// The values fit the declared type, and come in whole points and colours.
fn check(mut p: Param) -> Result<Param> {
    let wrong_kind = |p: &Param, found: &str, expected: &str| {
        let message = format!("parameter \"{}\" has values of the wrong kind", p.name);
        SceneError::value(&p.at, message)
            .found(found)
            .expected(expected)
    };
    // Older files quote their booleans.
    if p.ty == Type::Bool
        && let Values::Strings(s) = &p.values
        && let Some(b) = s.iter().map(|s| s.parse().ok()).collect::<Option<Vec<_>>>()
    {
        p.values = Values::Bools(b);
    }
    match (&p.values, p.ty) {
        (Values::Strings(_), Type::String | Type::Texture | Type::Spectrum)
        | (Values::Bools(_), Type::Bool) => {}
        (Values::Numbers(v), ty) if ty.arity().is_some() => {
            let n = ty.arity().unwrap_or(1);
            if v.len() % n != 0 {
                let message = format!("parameter \"{}\" has a wrong number of numbers", p.name);
                return Err(SceneError::value(&p.at, message)
                    .found(v.len())
                    .expected(format!("a multiple of {n}")));
            }
            if ty == Type::Integer
                && let Some(x) = v
                    .iter()
                    .find(|x| x.fract() != 0.0 || x.abs() > f64::from(u32::MAX))
            {
                return Err(wrong_kind(&p, &x.to_string(), "32-bit integers"));
            }
        }
        (Values::Numbers(_), ty) => return Err(wrong_kind(&p, "numbers", ty.name())),
        (Values::Strings(_), ty) => return Err(wrong_kind(&p, "strings", ty.name())),
        (Values::Bools(_), ty) => return Err(wrong_kind(&p, "booleans", ty.name())),
    }
    Ok(p)
}
