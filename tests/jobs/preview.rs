//! A viewer's side of a preview: every packet is read as tev reads it.

use super::kill::{bits, folder, scene};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// What a packet says.
#[derive(Debug, PartialEq)]
enum Packet {
    Create {
        name: String,
        size: [i32; 2],
        channels: Vec<String>,
    },
    Update {
        name: String,
        place: [i32; 4],
        channels: Vec<Vec<f32>>,
    },
    Open {
        path: String,
    },
}

/// Fields of a packet, one after the other.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (head, rest) = self.0.split_at(N);
        self.0 = rest;
        head.try_into().expect("N bytes")
    }

    fn flag(&mut self) -> bool {
        let [b] = self.take();
        assert!(b < 2, "a truth value is {b}");
        b == 1
    }

    fn int(&mut self) -> i32 {
        i32::from_le_bytes(self.take())
    }

    fn text(&mut self) -> String {
        let end = self
            .0
            .iter()
            .position(|b| *b == 0)
            .expect("a string that ends");
        let text = String::from_utf8(self.0[..end].to_vec()).expect("UTF-8");
        self.0 = &self.0[end + 1..];
        text
    }

    fn texts(&mut self) -> Vec<String> {
        let n = self.int();
        (0..n).map(|_| self.text()).collect()
    }
}

/// The next packet; `None` when the other side has closed.
fn read(stream: &mut TcpStream) -> Option<Packet> {
    let mut length = [0; 4];
    stream.read_exact(&mut length).ok()?;
    let length = u32::from_le_bytes(length) as usize;
    assert!((6..1 << 26).contains(&length), "a packet of {length} bytes");
    let mut body = vec![0; length - 4];
    stream
        .read_exact(&mut body)
        .expect("as many bytes as it says");
    let mut f = Fields(&body[1..]);
    let packet = match body[0] {
        0 => {
            f.flag();
            Packet::Open { path: f.text() }
        }
        4 => {
            f.flag();
            let name = f.text();
            let size = [f.int(), f.int()];
            Packet::Create {
                name,
                size,
                channels: f.texts(),
            }
        }
        6 => {
            f.flag();
            let name = f.text();
            let names = f.texts();
            assert_eq!(names, ["R", "G", "B"]);
            let place = [f.int(), f.int(), f.int(), f.int()];
            let [offsets, strides] = [0; 2].map(|_| [0; 3].map(|_| i64::from_le_bytes(f.take())));
            let pixels = (place[2] * place[3]) as usize;
            let bytes = std::mem::take(&mut f.0);
            let value =
                |i: usize| f32::from_le_bytes(bytes[4 * i..4 * i + 4].try_into().expect("4"));
            let channel = |c: usize| -> Vec<f32> {
                let at = |p: usize| offsets[c] as usize + p * strides[c] as usize;
                (0..pixels).map(|p| value(at(p))).collect()
            };
            assert_eq!(bytes.len(), 12 * pixels);
            let channels = (0..3).map(channel).collect();
            Packet::Update {
                name,
                place,
                channels,
            }
        }
        kind => panic!("a packet of type {kind}"),
    };
    assert!(f.0.is_empty(), "{} bytes too many", f.0.len());
    Some(packet)
}

fn start(dir: &Path, port: u16, more: &[&str]) -> Child {
    let mut c = Command::new(env!("CARGO_BIN_EXE_metrolux"));
    c.current_dir(dir).arg("render").arg(scene());
    c.args([
        "--resolution",
        "40x30",
        "--region",
        "8,6,40,30",
        "-o",
        "a.exr",
    ]);
    c.arg("--preview")
        .arg(format!("tev:127.0.0.1:{port}"))
        .args(more);
    c.stderr(Stdio::piped()).spawn().expect("it starts")
}

fn ended(child: Child) -> (Option<i32>, String) {
    let out = child.wait_with_output().expect("it ends");
    (
        out.status.code(),
        String::from_utf8_lossy(&out.stderr).into_owned(),
    )
}

#[test]
fn every_packet_is_as_tev_reads_it() {
    let dir = folder();
    let server = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = server.local_addr().expect("bound").port();
    let child = start(dir.path(), port, &["--time-limit", "4s"]);
    let (mut stream, _) = server.accept().expect("the render comes");
    let mut all = Vec::new();
    while let Some(packet) = read(&mut stream) {
        all.push(packet);
    }
    let (code, said) = ended(child);
    assert_eq!(code, Some(0), "{said}");
    let create = Packet::Create {
        name: "a.exr".into(),
        size: [40, 30],
        channels: ["R", "G", "B"].map(String::from).to_vec(),
    };
    assert_eq!(all[0], create);
    let path = std::path::absolute(dir.path().join("a.exr")).expect("a path");
    let Some(Packet::Open { path: opened }) = all.last() else {
        panic!("the last is {:?}", all.last());
    };
    let same = |a: &Path, b: &Path| a.canonicalize().ok() == b.canonicalize().ok();
    assert!(same(Path::new(opened), &path), "{opened}");
    let updates = &all[1..all.len() - 1];
    // One a second or so, and the final one.
    assert!(
        (2..=6).contains(&updates.len()),
        "{} updates",
        updates.len()
    );
    let mut last = Vec::new();
    for u in updates {
        let Packet::Update {
            name,
            place,
            channels,
        } = u
        else {
            panic!("between the first and the last came {u:?}");
        };
        assert_eq!((name.as_str(), *place), ("a.exr", [8, 6, 32, 24]));
        let pixels = (0..32 * 24).flat_map(|p| [0, 1, 2].map(|c| channels[c][p].to_bits()));
        last = pixels.collect();
    }
    assert!(last == bits(&dir.path().join("a.exr")));
}

#[test]
fn a_viewer_that_goes_away_or_never_comes_stops_nothing() {
    let dir = folder();
    let dir = dir.path();
    let work = ["--rounds", "200", "--max-depth", "5"];
    let server = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = server.local_addr().expect("bound").port();
    let child = start(dir, port, &work);
    let (mut stream, _) = server.accept().expect("the render comes");
    let first = read(&mut stream);
    assert!(matches!(first, Some(Packet::Create { .. })), "{first:?}");
    drop((stream, server));
    let (code, said) = ended(child);
    assert_eq!(code, Some(0), "{said}");
    let whole = bits(&dir.join("a.exr"));
    // Nobody listens there any more.
    let (code, said) = ended(start(dir, port, &work));
    assert_eq!(code, Some(0), "{said}");
    let warning = format!("warning: nothing is shown at 127.0.0.1:{port}: ");
    assert_eq!(said.matches(&warning).count(), 1, "{said}");
    assert!(bits(&dir.join("a.exr")) == whole);
}

/// A viewer that takes the connection and then reads nothing.
#[test]
fn a_viewer_that_hangs_is_given_up() {
    let dir = folder();
    let server = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = server.local_addr().expect("bound").port();
    let mut c = Command::new(env!("CARGO_BIN_EXE_metrolux"));
    c.current_dir(dir.path()).arg("render").arg(scene());
    // Each image is more than the system keeps for a connection.
    c.args([
        "--resolution",
        "1400x1000",
        "--integrator",
        "pt",
        "--max-depth",
        "1",
    ]);
    c.args(["--time-limit", "3s", "-o", "a.png", "--preview"])
        .arg(format!("tev:127.0.0.1:{port}"));
    let begun = Instant::now();
    let child = c.stderr(Stdio::piped()).spawn().expect("it starts");
    let (mut stream, _) = server.accept().expect("the render comes");
    stream.write_all(b"").expect("open");
    let (code, said) = ended(child);
    assert_eq!(code, Some(0), "{said}");
    assert!(
        begun.elapsed() < Duration::from_secs(60),
        "{:?}",
        begun.elapsed()
    );
}
