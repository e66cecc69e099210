//! The generator of the scenes' geometry, shared by the example and its test.

pub mod ajar;
pub mod bezier;
pub mod caustic;
pub mod cornell;
pub mod door;
pub mod furnace;
pub mod furniture;
pub mod lathe;
pub mod mesh;
pub mod newell;
pub mod pool;
pub mod prism;
pub mod shell;
pub mod teapot;
pub mod text;
pub mod trig;
pub mod tube;

/// One generated file.
pub struct Output {
    /// Path below `scenes/`, with forward slashes.
    pub path: String,
    /// Contents.
    pub bytes: Vec<u8>,
}

impl Output {
    /// A text file.
    pub fn text(path: &str, text: String) -> Self {
        Self {
            path: path.into(),
            bytes: text.into_bytes(),
        }
    }
}

/// Everything that is generated, in a fixed order.
pub fn outputs() -> Vec<Output> {
    let mut all = ajar::outputs();
    all.extend(cornell::outputs());
    all.extend(furnace::outputs());
    all.extend(caustic::outputs());
    all.extend(pool::outputs());
    all.extend(prism::outputs());
    all
}
