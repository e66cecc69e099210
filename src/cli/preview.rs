//! A viewer that shows the image while it is rendered. It runs beside the render, which never waits for it.

use super::voice::{Level, Voice};
use crate::output::{Image, TEV_PORT, create_image, open_image, update_image};
use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Where a viewer listens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewerArg {
    host: String,
    port: u16,
}

/// Reads `tev`, `tev:HOST` or `tev:HOST:PORT`.
///
/// # Errors
/// What was expected.
pub fn viewer(s: &str) -> Result<ViewerArg, String> {
    let wrong = || "expected tev, tev:HOST or tev:HOST:PORT".to_owned();
    let rest = s.strip_prefix("tev").ok_or_else(wrong)?;
    if rest.is_empty() {
        let host = "127.0.0.1".into();
        return Ok(ViewerArg {
            host,
            port: TEV_PORT,
        });
    }
    let rest = rest.strip_prefix(':').ok_or_else(wrong)?;
    // An IPv6 address stands in brackets.
    let (host, port) = match rest.rsplit_once(':') {
        Some((host, port)) if !port.ends_with(']') => (host, port.parse().map_err(|_| wrong())?),
        _ => (rest, TEV_PORT),
    };
    let host = host.trim_start_matches('[').trim_end_matches(']');
    if host.is_empty() {
        return Err(wrong());
    }
    let host = host.to_owned();
    Ok(ViewerArg { host, port })
}

/// A viewer that takes nothing for so long is given up.
const STALLED: Duration = Duration::from_secs(3);
/// Images are shown so far apart at least, and so that making them takes at most 5 % of the time.
const APART: Duration = Duration::from_secs(1);
const PRICE: u32 = 20;

/// What the viewer is to show.
enum Show {
    Pixels(Image),
    File(String),
}

/// The viewer's side, on a thread of its own.
struct Sender {
    to: ViewerArg,
    name: String,
    size: [usize; 2],
    origin: [usize; 2],
    trouble: Arc<Mutex<Option<String>>>,
}

impl Sender {
    fn run(self, shows: &Receiver<Show>) {
        let mut open: Option<TcpStream> = None;
        for show in shows {
            let sent = match open.take() {
                Some(stream) => Ok(stream),
                // A viewer that comes, or comes back, is shown the next image.
                None => self.connect(),
            };
            match sent.and_then(|stream| self.send(stream, &show)) {
                Ok(stream) => open = Some(stream),
                Err(e) => {
                    use io::ErrorKind::{TimedOut, WouldBlock};
                    let hangs = matches!(e.kind(), TimedOut | WouldBlock);
                    let text =
                        format!("nothing is shown at {}:{}: {e}", self.to.host, self.to.port);
                    *self.trouble.lock().unwrap_or_else(PoisonError::into_inner) = Some(text);
                    if hangs {
                        return;
                    }
                }
            }
        }
    }

    fn connect(&self) -> io::Result<TcpStream> {
        let places = (self.to.host.as_str(), self.to.port).to_socket_addrs()?;
        let mut last = io::Error::from(io::ErrorKind::AddrNotAvailable);
        for at in places {
            match TcpStream::connect_timeout(&at, STALLED) {
                Ok(mut stream) => {
                    stream.set_write_timeout(Some(STALLED))?;
                    stream.write_all(&create_image(&self.name, self.size))?;
                    return Ok(stream);
                }
                Err(e) => last = e,
            }
        }
        Err(last)
    }

    fn send(&self, mut stream: TcpStream, show: &Show) -> io::Result<TcpStream> {
        match show {
            Show::Pixels(image) => {
                for packet in update_image(&self.name, self.origin, image) {
                    stream.write_all(&packet)?;
                }
            }
            Show::File(path) => stream.write_all(&open_image(path))?,
        }
        Ok(stream)
    }
}

/// The render's side.
pub struct Preview {
    shows: Option<SyncSender<Show>>,
    over: Receiver<()>,
    trouble: Arc<Mutex<Option<String>>>,
    told: bool,
    local: bool,
    last: Instant,
    price: Duration,
}

impl Preview {
    /// For an image of this name and full size, of which the part at `origin` is rendered.
    pub fn new(to: &ViewerArg, name: &str, size: [u32; 2], origin: [u32; 2]) -> Self {
        let (shows, heard) = sync_channel(1);
        let (ends, over) = channel();
        let trouble = Arc::default();
        let sender = Sender {
            to: to.clone(),
            name: name.into(),
            size: size.map(|v| v as usize),
            origin: origin.map(|v| v as usize),
            trouble: Arc::clone(&trouble),
        };
        std::thread::spawn(move || {
            sender.run(&heard);
            let _ = ends.send(());
        });
        Self {
            shows: Some(shows),
            over,
            trouble,
            told: false,
            local: ["127.0.0.1", "localhost", "::1"].contains(&to.host.as_str()),
            last: Instant::now(),
            price: Duration::ZERO,
        }
    }

    /// Time that a render may work before it asks again whether an image is due.
    pub fn patience() -> Duration {
        APART
    }

    /// It is time for another image.
    pub fn due(&self) -> bool {
        self.last.elapsed() >= APART.max(self.price * PRICE)
    }

    /// Shows what `make` makes, unless the viewer is still busy with the one before.
    pub fn show(&mut self, voice: &Voice, make: impl FnOnce() -> Image) {
        let begun = Instant::now();
        let image = make();
        self.price = begun.elapsed();
        self.last = Instant::now();
        if let Some(shows) = &self.shows
            && let Err(TrySendError::Disconnected(_)) = shows.try_send(Show::Pixels(image))
        {
            self.shows = None;
        }
        self.complain(voice);
    }

    /// Shows the final image, and its file if the viewer is on this machine. Waits for a viewer that keeps up.
    pub fn finish(mut self, voice: &Voice, image: Image, file: Option<&Path>) {
        let path = file.and_then(|f| std::path::absolute(f).ok());
        let path = path.filter(|_| self.local);
        let last = [
            Some(Show::Pixels(image)),
            path.map(|p| Show::File(p.display().to_string())),
        ];
        if let Some(shows) = self.shows.take() {
            // The place in the queue is taken for as long as the viewer is at the image before.
            std::thread::spawn(move || {
                last.into_iter()
                    .flatten()
                    .try_for_each(|show| shows.send(show))
            });
        }
        let _ = self.over.recv_timeout(4 * STALLED);
        self.complain(voice);
    }

    /// Tells the first trouble.
    fn complain(&mut self, voice: &Voice) {
        let found = self
            .trouble
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        if let Some(text) = found
            && !self.told
        {
            voice.say(Level::Warning, &format!("{text}; the render goes on"));
            self.told = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viewers_are_named_by_host_and_port() {
        let of = |s: &str| viewer(s).map(|v| format!("{} {}", v.host, v.port));
        for (s, is) in [
            ("tev", "127.0.0.1 14158"),
            ("tev:box", "box 14158"),
            ("tev:box:99", "box 99"),
            ("tev:[::1]", "::1 14158"),
            ("tev:[::1]:99", "::1 99"),
        ] {
            assert_eq!(of(s).as_deref(), Ok(is), "{s}");
        }
        for s in ["", "tex", "tev:", "tev:box:far", "tevbox", "tev::99"] {
            assert!(of(s).is_err(), "{s}");
        }
    }
}
