//! PLY: three encodings, one mesh; broken files are errors.

use metrolux::scene::Scene;
use metrolux::scene::load::{LoadOptions, SceneError, load_str};

/// A triangle and a quad that share an edge, with normals and coordinates.
const VERTICES: [[f32; 8]; 6] = [
    [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0],
    [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0],
    [2.5, 0.5, 0.125, 0.0, 0.0, 1.0, 2.0, 0.0],
    [3.0, 0.1, 0.0, 0.0, 0.0, 1.0, 0.0, 2.0],
];
const FACES: [&[i32]; 2] = [&[0, 1, 2, 3], &[1, 4, 2]];

fn header(format: &str, vertices: u64, faces: u64) -> String {
    let properties: String = ["x", "y", "z", "nx", "ny", "nz", "s", "t"]
        .iter()
        .map(|n| format!("property float {n}\n"))
        .collect();
    format!(
        "ply\nformat {format} 1.0\nelement vertex {vertices}\n{properties}element face {faces}\n\
         property list uchar int vertex_indices\nend_header\n"
    )
}

fn ascii() -> Vec<u8> {
    let mut s = header("ascii", 6, 2);
    for v in VERTICES {
        s += &v.map(|x| x.to_string()).join(" ");
        s += "\n";
    }
    for f in FACES {
        s += &format!("{}", f.len());
        f.iter().for_each(|i| s += &format!(" {i}"));
        s += "\n";
    }
    s.into_bytes()
}

fn binary(big: bool) -> Vec<u8> {
    let format = if big {
        "binary_big_endian"
    } else {
        "binary_little_endian"
    };
    let mut out = header(format, 6, 2).into_bytes();
    let order = |b: [u8; 4]| {
        let mut b = b;
        if big {
            b.reverse();
        }
        b
    };
    for v in VERTICES.iter().flatten() {
        out.extend(order(v.to_le_bytes()));
    }
    for f in FACES {
        out.push(f.len() as u8);
        f.iter().for_each(|i| out.extend(order(i.to_le_bytes())));
    }
    out
}

fn load(content: &[u8]) -> Result<Scene, SceneError> {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("a mesh.ply"), content).unwrap();
    let text = "WorldBegin Shape \"plymesh\" \"string filename\" \"a mesh.ply\"";
    load_str(text, dir.path(), &LoadOptions::default())
}

fn error(content: &[u8]) -> String {
    load(content).unwrap_err().to_string()
}

#[test]
fn encodings_agree() {
    let a = load(&ascii()).unwrap();
    let g = &a.geometry;
    assert_eq!(g.triangles.len(), 3);
    assert!(g.shapes.iter().all(|s| s.has_normals && s.has_uvs));
    for big in [false, true] {
        let b = load(&binary(big)).unwrap();
        assert_eq!(g.positions, b.geometry.positions);
        assert_eq!(g.normals, b.geometry.normals);
        assert_eq!(g.uvs, b.geometry.uvs);
        assert_eq!(g.triangles, b.geometry.triangles);
        assert_eq!(a.hash, b.hash);
    }
    // The quad's corners go around; its coordinates stay with them.
    for (p, uv) in g.positions.iter().zip(&g.uvs).filter(|(p, _)| p.x <= 1.0) {
        assert_eq!(p.truncate(), *uv);
    }
}

#[test]
fn broken_files() {
    let claim = |v, f| {
        let mut out = header("binary_little_endian", v, f).into_bytes();
        out.extend([0; 64]);
        out
    };
    for content in [claim(1 << 40, 1), claim(2, u64::MAX)] {
        let e = error(&content);
        assert!(e.contains("the header claims at least"), "{e}");
    }
    let text = String::from_utf8(ascii()).unwrap();
    let e = error(text.replace("3 1 4 2", "3 1 4 6").as_bytes());
    assert!(e.ends_with(": face 1 has vertex 6, expected 0 to 5"), "{e}");
    let e = error(text.replace("3 1 4 2", "3 1 4 -1").as_bytes());
    assert!(e.contains("face 1 without a list"), "{e}");
    let e = error(text.replace("2.5 0.5", "nan 0.5").as_bytes());
    assert!(
        e.contains("element vertex: Line 19") && !e.contains('\n'),
        "{e}"
    );
    let mut nan = binary(false);
    let at = header("binary_little_endian", 6, 2).len() + 4 * 8 * 4;
    nan[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let e = error(&nan);
    assert!(e.ends_with(": vertex 4 is not finite"), "{e}");
    let e = error(text.replace("3 1 4 2", "2 1 4").as_bytes());
    assert!(
        e.ends_with(": face 1 has 2 corners, expected 3 or 4"),
        "{e}"
    );
    assert!(error(b"").starts_with("<text>:1:28: cannot read the mesh "));
    // Cut anywhere, a file is an error and no panic.
    let whole = binary(false);
    for n in (0..whole.len()).step_by(7) {
        assert!(load(&whole[..n]).is_err(), "{n}");
    }
}
