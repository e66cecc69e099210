//! Triangle meshes and their binary PLY form.

use glam::{DAffine3, DMat3, DVec3};

/// A triangle mesh; flat where it has no normals.
#[derive(Clone, Default)]
pub struct Mesh {
    /// Positions.
    pub positions: Vec<DVec3>,
    /// Unit normals, parallel to the positions, or empty.
    pub normals: Vec<DVec3>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// A flat quadrilateral, counter-clockwise seen from its front.
    pub fn quad(&mut self, corners: [DVec3; 4]) {
        let base = self.positions.len() as u32;
        self.positions.extend(corners);
        self.triangles.push([base, base + 1, base + 2]);
        self.triangles.push([base, base + 2, base + 3]);
    }

    /// An axis-parallel box seen from outside.
    pub fn block(&mut self, lo: [f64; 3], hi: [f64; 3]) {
        let p = |i: usize| {
            let pick = |axis: usize| {
                if i >> axis & 1 == 0 {
                    lo[axis]
                } else {
                    hi[axis]
                }
            };
            DVec3::new(pick(0), pick(1), pick(2))
        };
        for face in [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ] {
            self.quad(face.map(p));
        }
    }

    /// A smooth sheet over rows of points, each row closed into a loop. A row of one point is an apex.
    ///
    /// Normals are the mean of the faces around a vertex of this sheet alone, so sheets meet in creases.
    pub fn loops(&mut self, rows: &[Vec<DVec3>]) {
        let mut sheet = Mesh::default();
        let mut starts = Vec::new();
        for row in rows {
            starts.push(sheet.positions.len());
            sheet.positions.extend(row);
        }
        for (i, pair) in rows.windows(2).enumerate() {
            let n = pair[0].len().max(pair[1].len());
            let at = |row: usize, j: usize| (starts[row] + j % rows[row].len()) as u32;
            for j in 0..n {
                let q = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                sheet.triangle_unless_degenerate([q[0], q[1], q[2]]);
                sheet.triangle_unless_degenerate([q[0], q[2], q[3]]);
            }
        }
        sheet.normals = vec![DVec3::ZERO; sheet.positions.len()];
        for t in &sheet.triangles {
            let [a, b, c] = t.map(|i| sheet.positions[i as usize]);
            for &i in t {
                sheet.normals[i as usize] += (b - a).cross(c - a);
            }
        }
        for n in &mut sheet.normals {
            *n = n.normalize();
        }
        self.append(&sheet);
    }

    /// Adds a triangle unless two of its corners are one vertex.
    pub fn triangle_unless_degenerate(&mut self, t: [u32; 3]) {
        if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] {
            self.triangles.push(t);
        }
    }

    /// Adds another mesh of the same kind.
    pub fn append(&mut self, other: &Mesh) {
        let base = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.normals.extend(&other.normals);
        let shifted = other.triangles.iter().map(|t| t.map(|i| i + base));
        self.triangles.extend(shifted);
    }

    /// The mesh moved by a map without reflection or uneven scaling.
    pub fn moved(&self, map: &DAffine3) -> Mesh {
        let rotate = DMat3::from_cols(
            map.matrix3.x_axis.normalize(),
            map.matrix3.y_axis.normalize(),
            map.matrix3.z_axis.normalize(),
        );
        Mesh {
            positions: (self.positions.iter())
                .map(|p| map.transform_point3(*p))
                .collect(),
            normals: self.normals.iter().map(|n| rotate * *n).collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// Area of all faces.
    pub fn area(&self) -> f64 {
        let twice = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| self.positions[i as usize]);
            (b - a).cross(c - a).length()
        };
        self.triangles.iter().map(twice).sum::<f64>() / 2.0
    }

    /// Enclosed volume, negative when the faces look inward.
    pub fn volume(&self) -> f64 {
        let six = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| self.positions[i as usize]);
            a.dot(b.cross(c))
        };
        self.triangles.iter().map(six).sum::<f64>() / 6.0
    }

    /// Turns a closed mesh so that its faces and normals look outward.
    pub fn outward(mut self) -> Mesh {
        if self.volume() < 0.0 {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            self.normals.iter_mut().for_each(|n| *n = -*n);
        }
        self
    }

    /// Little-endian binary PLY.
    pub fn ply(&self) -> Vec<u8> {
        let smooth = !self.normals.is_empty();
        assert!(!smooth || self.normals.len() == self.positions.len());
        let normal_lines = if smooth {
            "property float nx\nproperty float ny\nproperty float nz\n"
        } else {
            ""
        };
        let mut bytes = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\n\
             property float x\nproperty float y\nproperty float z\n{normal_lines}\
             element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.positions.len(),
            self.triangles.len()
        )
        .into_bytes();
        for (i, p) in self.positions.iter().enumerate() {
            // Adding 0 turns −0 into 0.
            let put = |v: DVec3| v.to_array().map(|c| (c as f32 + 0.0).to_le_bytes());
            bytes.extend(put(*p).concat());
            if smooth {
                bytes.extend(put(self.normals[i]).concat());
            }
        }
        for t in &self.triangles {
            bytes.push(3);
            t.iter()
                .for_each(|i| bytes.extend((*i as i32).to_le_bytes()));
        }
        bytes
    }
}
