//! The page in a real browser, on a desk and on a phone.

use std::fs;
use std::path::Path;
use std::process::Command;

fn browser() -> Option<&'static str> {
    let names = [
        "chromium",
        "chromium-browser",
        "google-chrome",
        "google-chrome-stable",
    ];
    names.into_iter().find(|n| {
        Command::new(n)
            .arg("--version")
            .output()
            .is_ok_and(|o| o.status.success())
    })
}

/// The document after loading, as the browser has it.
fn dom(name: &str, page: &Path, width: u32, home: &Path) -> String {
    let done = Command::new(name)
        .args([
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--virtual-time-budget=4000",
            "--dump-dom",
        ])
        .arg(format!("--window-size={width},900"))
        .arg(format!("--user-data-dir={}", home.display()))
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("the browser runs");
    String::from_utf8_lossy(&done.stdout).into_owned()
}

/// What the page measures of itself: width of its content, of its window, images, images that could be shown, charts seen,
/// errors of the console.
const MEASURE: &str = "<script>addEventListener('load',()=>{const d=document,\
    shown=e=>e.getBoundingClientRect().height>60,\
    r=[d.documentElement.scrollWidth,innerWidth,d.images.length,[...d.images].filter(i=>i.naturalWidth>0).length,\
    [...d.querySelectorAll('.chart>svg')].filter(shown).length,d.querySelectorAll('section').length].join(' ');\
    d.body.dataset.measured=r;if(parent!==window)parent.postMessage(r,'*')})</script></body>";

fn measured(dom: &str) -> Vec<f64> {
    let text = dom
        .split("data-measured=\"")
        .nth(1)
        .and_then(|t| t.split('"').next());
    let text = text.unwrap_or_else(|| {
        panic!(
            "the page did not measure itself:\n{}",
            &dom[..dom.len().min(2000)]
        )
    });
    text.split(' ')
        .map(|n| n.parse().expect("a number"))
        .collect()
}

#[test]
fn the_page_fits_a_desk_and_a_phone() {
    let Some(name) = browser() else {
        println!("skipped: no chromium or chrome is installed");
        return;
    };
    let dir = tempfile::tempdir().expect("a folder");
    let out = dir.path().join("study");
    let mut study = assert_cmd::Command::new(env!("CARGO_BIN_EXE_metrolux"));
    study
        .args(super::command::small_study(&out, "6s"))
        .assert()
        .code(0);
    let page = fs::read_to_string(out.join("index.html")).expect("a page");
    let test = out.join("test.html");
    fs::write(&test, page.replace("</body>", MEASURE)).expect("written");
    // A window narrower than 500 px is not to be had; a frame is.
    let phone = out.join("phone.html");
    let frame = "<body><iframe src=\"test.html\" style=\"border:0;width:360px;height:900px\"></iframe>\
        <script>addEventListener('message',m=>document.body.dataset.measured=m.data)</script></body>";
    fs::write(&phone, frame).expect("written");
    for (what, file, width) in [("desk", &test, 1280), ("phone", &phone, 600)] {
        let m = measured(&dom(name, file, width, &dir.path().join(what)));
        println!("{what}: {m:?}");
        let [content, window, images, loaded, charts, sections] = m[..] else {
            panic!("{m:?}");
        };
        assert!(
            content <= window,
            "{what}: {content} px of content in {window} px"
        );
        assert!(
            images > 12.0 && images == loaded,
            "{what}: {loaded} of {images} images shown"
        );
        // One chart of each axis, whichever error is chosen.
        assert_eq!(charts, 2.0, "{what}");
        assert_eq!(sections, 5.0, "{what}");
    }
    let shot = dir.path().join("shot.png");
    let done = Command::new(name)
        .args([
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--window-size=1280,1400",
        ])
        .arg(format!(
            "--user-data-dir={}",
            dir.path().join("shot").display()
        ))
        .arg(format!("--screenshot={}", shot.display()))
        .arg(format!("file://{}", out.join("index.html").display()))
        .output()
        .expect("the browser runs");
    assert!(done.status.success());
    let image = metrolux::output::read_image(&shot).expect("a screenshot");
    let colours: std::collections::BTreeSet<[u32; 3]> =
        image.rgb.iter().map(|p| p.map(f32::to_bits)).collect();
    // A blank page or an error page has a few dozen; pictures and charts make thousands.
    assert!(colours.len() > 500, "{} colours", colours.len());
}
