//! Writes every generated file of `scenes/`: `cargo run --example make_scenes [DIRECTORY]`.
//!
//! The output is committed; `tests/scenes.rs` checks that it is what this program writes.

mod tools;

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let root = match std::env::args_os().nth(1) {
        Some(directory) => PathBuf::from(directory),
        None => PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes")),
    };
    for file in tools::outputs() {
        let path = root.join(&file.path);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::write(&path, &file.bytes)?;
        println!("{:>9}  {}", file.bytes.len(), path.display());
    }
    println!(
        "the opening beside and above ajar's door: {:.4} m²",
        tools::door::opening().area()
    );
    Ok(())
}
