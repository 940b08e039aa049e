//! The page in a real browser, headless: no error on its console, tables sort and filter, sliders move, figures zoom together and say what they count, and it
//! fits a phone.
//!
//! `cargo test --test it browser:: -- --ignored`: needs `chromedriver` (Debian: `chromium` and `chromium-driver`) and passes without a word of proof where there is none, unless `CI` is set. With
//! `WARPCHECK_SCREENSHOTS=DIR` the pictures of the page go there.

use assert_cmd::cargo::cargo_bin;
use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tempfile::tempdir;

/// A browser, spoken to by WebDriver (W3C): JSON over HTTP.
struct Browser {
    driver: Child,
    port: u16,
    session: String,
}

impl Browser {
    /// `None` where none is installed.
    fn start() -> Option<Self> {
        let mut driver = match Command::new("chromedriver")
            .arg("--port=0")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
        {
            Ok(driver) => driver,
            Err(error) if std::env::var_os("CI").is_some() => {
                panic!(
                    "chromedriver is needed where CI is set (apt-get install chromium chromium-driver): {error}"
                )
            }
            Err(error) => {
                eprintln!("skipped: no chromedriver ({error}); Debian has it as chromium-driver");
                return None;
            }
        };
        // "ChromeDriver was started successfully on port 41234."
        let lines = BufReader::new(driver.stdout.take().unwrap()).lines();
        let port = lines
            .map_while(Result::ok)
            .find_map(|line| line.split_once("successfully on port ")?.1.trim_end_matches('.').parse().ok())
            .expect("the driver says its port");
        let mut browser = Self { driver, port, session: String::new() };
        let options = json!({ "args": ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"] });
        let wanted = json!({ "capabilities": { "alwaysMatch": {
            "browserName": "chrome",
            "goog:chromeOptions": options,
            "goog:loggingPrefs": { "browser": "ALL" },
        } } });
        let session = browser.call("POST", "/session", &wanted);
        browser.session = format!("/session/{}", session["sessionId"].as_str().unwrap());
        Some(browser)
    }

    fn call(&self, method: &str, path: &str, body: &Value) -> Value {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(120))).unwrap();
        let body = if method == "POST" { body.to_string() } else { String::new() };
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        )
        .unwrap();
        // The length is told, and the line may stay open.
        let mut reader = BufReader::new(stream);
        let mut length = 0;
        loop {
            let mut line = String::new();
            reader.read_line(&mut line).unwrap();
            if line.trim().is_empty() {
                break;
            }
            if let Some((name, value)) =
                line.split_once(':').filter(|(n, _)| n.eq_ignore_ascii_case("content-length"))
            {
                length = value.trim().parse().unwrap_or_else(|_| panic!("{name}: {value}"));
            }
        }
        let mut answer = vec![0; length];
        reader.read_exact(&mut answer).unwrap();
        let answer: Value = serde_json::from_slice(&answer).unwrap();
        assert!(answer["value"]["error"].is_null(), "{method} {path}: {:.600}", answer["value"]);
        answer["value"].clone()
    }

    fn post(&self, path: &str, body: Value) -> Value {
        self.call("POST", &format!("{}{path}", self.session), &body)
    }

    fn open(&self, page: &Path) {
        self.post("/url", json!({ "url": format!("file://{}", page.display()) }));
    }

    /// Runs a script in the page and returns what it returns.
    fn script(&self, script: &str) -> Value {
        self.post("/execute/sync", json!({ "script": script, "args": [] }))
    }

    fn find(&self, css: &str) -> String {
        let found = self.post("/element", json!({ "using": "css selector", "value": css }));
        found.as_object().unwrap().values().next().unwrap().as_str().unwrap().to_owned()
    }

    fn click(&self, css: &str) {
        // To the middle: at the top it would be under the bar of links.
        self.script(&format!(
            "document.querySelector({css:?}).scrollIntoView({{block: 'center', behavior: 'instant'}})"
        ));
        let element = self.find(css);
        self.post(&format!("/element/{element}/click"), json!({}));
    }

    fn keys(&self, css: &str, text: &str) {
        let element = self.find(css);
        self.post(&format!("/element/{element}/value"), json!({ "text": text }));
    }

    fn point_at(&self, css: &str) {
        self.script(&format!(
            "document.querySelector({css:?}).scrollIntoView({{block: 'center', behavior: 'instant'}})"
        ));
        let element = self.find(css);
        let origin = json!({ "element-6066-11e4-a52e-4f735466cecf": element });
        let moves = [3, 4, 5]
            .map(|x| json!({ "type": "pointerMove", "duration": 60, "origin": origin, "x": x, "y": 2 }));
        let mouse = json!({ "type": "pointer", "id": "mouse", "parameters": { "pointerType": "mouse" }, "actions": moves });
        self.post("/actions", json!({ "actions": [mouse] }));
    }

    fn chrome(&self, command: &str, parameters: Value) {
        self.post("/goog/cdp/execute", json!({ "cmd": command, "params": parameters }));
    }

    fn size(&self, width: u32, height: u32, dark: bool) {
        let mobile = width < 500;
        self.chrome(
            "Emulation.setDeviceMetricsOverride",
            json!({ "width": width, "height": height, "deviceScaleFactor": if mobile { 2 } else { 1 }, "mobile": mobile }),
        );
        let scheme = if dark { "dark" } else { "light" };
        self.chrome(
            "Emulation.setEmulatedMedia",
            json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] }),
        );
    }

    /// What is on the screen, as PNG.
    fn screenshot(&self, name: &str) -> image::RgbImage {
        // In a tab of its own every picture has been decoded by then.
        self.script("return Promise.all([...document.images].filter(i => i.getBoundingClientRect().top < innerHeight * 2).map(i => i.decode().catch(() => 0))).then(() => 1)");
        let text = self.call("GET", &format!("{}/screenshot", self.session), &Value::Null);
        let bytes = base64(text.as_str().unwrap());
        // README shows two of them.
        let shown = ["report.png", "report-phone.png"].contains(&name);
        let folder = std::env::var_os("WARPCHECK_SCREENSHOTS").filter(|_| shown);
        let folder = folder.map_or_else(|| PathBuf::from(env!("CARGO_TARGET_TMPDIR")), PathBuf::from);
        fs::write(folder.join(name), &bytes).unwrap();
        image::load_from_memory(&bytes).unwrap().into_rgb8()
    }

    /// Nothing was complained about since the last time.
    #[track_caller]
    fn is_quiet(&self) {
        let log = self.post("/se/log", json!({ "type": "browser" }));
        assert_eq!(log, json!([]), "the console says something");
    }

    /// Nothing sticks out on the right.
    #[track_caller]
    fn fits(&self) {
        let size = self.script("return [document.documentElement.scrollWidth, innerWidth]");
        assert!(size[0].as_f64() <= size[1].as_f64(), "{size}");
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        if !self.session.is_empty() && !std::thread::panicking() {
            self.call("DELETE", &self.session.clone(), &Value::Null);
        }
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

fn base64(text: &str) -> Vec<u8> {
    const LETTERS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let (mut out, mut bits, mut number) = (Vec::new(), 0_u32, 0);
    for value in text.bytes().filter_map(|b| LETTERS.iter().position(|&l| l == b)) {
        bits = bits << 6 | value as u32;
        number += 6;
        if number >= 8 {
            number -= 8;
            out.push((bits >> number) as u8);
            bits &= (1 << number) - 1;
        }
    }
    out
}

fn report(folder: &Path, words: &str, code: i32) -> PathBuf {
    let mut command = Command::new(cargo_bin!("warpcheck"));
    command
        .current_dir(folder)
        .args(words.split_whitespace())
        .args(["--report", "page"])
        .stdin(Stdio::null());
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(code), "{words}: {output:?}");
    folder.join("page/index.html")
}

/// The first column of the first sortable table.
const FIRST: &str = "return [...document.querySelector('table.sortable').tBodies[0].rows].filter(r => !r.hidden).map(r => r.cells[0].textContent.trim())";

#[test]
#[ignore = "long: a browser of its own"]
fn samplers_in_a_browser() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempdir().unwrap();
    let words = "verify broken/lobes/uniform-for-cosine hemisphere/cosine phong/50 triangle/low-distortion ggx/0.1 --samples 100k";
    let page = report(folder.path(), words, 1);
    browser.size(1280, 2000, false);
    browser.open(&page);
    browser.fits();
    let shot = browser.screenshot("report.png");
    assert_eq!(shot.dimensions(), (1280, 2000));

    // Failures come first; then as one likes.
    let names = |value: Value| {
        value.as_array().unwrap().iter().map(|v| v.as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let before = names(browser.script(FIRST));
    assert_eq!((before.len(), before[0].as_str()), (5, "broken/lobes/uniform-for-cosine"));
    browser.click("table.sortable th:first-child button");
    let mut sorted = before.clone();
    sorted.sort();
    assert_eq!(names(browser.script(FIRST)), sorted);
    browser.click("table.sortable th:first-child button");
    sorted.reverse();
    assert_eq!(names(browser.script(FIRST)), sorted);
    browser.click("table.sortable th.number:last-child button");
    let times = "return [...document.querySelector('table.sortable').tBodies[0].rows].map(r => Number(r.cells[r.cells.length - 1].dataset.sort))";
    let times: Vec<f64> =
        browser.script(times).as_array().unwrap().iter().map(|t| t.as_f64().unwrap()).collect();
    assert!(times.is_sorted(), "{times:?}");
    // By words, and by verdict.
    browser.keys(".filter input[type=search]", "ph");
    assert_eq!(browser.script(FIRST).as_array().unwrap().len(), 2, "hemisphere and phong");
    browser.keys(".filter input[type=search]", "\u{e003}\u{e003}"); // backspaces
    browser.click(".filter input[value=pass]");
    assert_eq!(names(browser.script(FIRST)), ["broken/lobes/uniform-for-cosine"]);
    browser.click(".filter input[value=pass]");

    // The link opens what is closed.
    browser.click("a[href='#sampler-phong-50']");
    assert_eq!(browser.script("return document.getElementById('sampler-phong-50').open"), true);

    // All three zoom together, and say what is counted where.
    let figures = "#sampler-phong-50 .figures.zoom";
    browser.click(&format!("{figures} .zoom-tools button"));
    let scales = format!(
        "return [...document.querySelectorAll({:?})].map(i => i.style.transform)",
        format!("{figures} img")
    );
    let scales = names(browser.script(&scales));
    assert!(
        scales.len() == 3 && scales.iter().all(|s| s.starts_with("scale(2)") && s == &scales[0]),
        "{scales:?}"
    );
    let pane = format!("{figures} .pane");
    browser.point_at(&pane);
    std::thread::sleep(Duration::from_millis(300)); // the index is decoded at the first look
    browser.point_at(&pane);
    let said = browser
        .script(&format!("return document.querySelector({:?}).textContent", format!("{figures} .reading")));
    let said = said.as_str().unwrap();
    assert!(said.starts_with("observed ") && said.contains(" σ; theta "), "{said}");

    browser.size(1280, 1500, true);
    let dark = browser.screenshot("report-dark.png");
    let lightness = |shot: &image::RgbImage| {
        shot.pixels().map(|p| f64::from(p[1])).sum::<f64>() / shot.pixels().len() as f64
    };
    assert!(lightness(&dark) < 100.0 && lightness(&shot) > 200.0);

    browser.size(390, 1050, false);
    browser.open(&page);
    browser.fits();
    browser.screenshot("report-phone-top.png");
    browser
        .script("document.querySelector('details.sampler .command').scrollIntoView({behavior: 'instant'})");
    assert_eq!(browser.screenshot("report-phone.png").dimensions(), (780, 2100));
    // On paper everything is open.
    browser.script("dispatchEvent(new Event('beforeprint'))");
    assert_eq!(browser.script("return document.querySelectorAll('details:not([open])').length"), 0);
    browser.script("dispatchEvent(new Event('afterprint'))");
    browser.is_quiet();
}

#[test]
#[ignore = "long: a browser of its own"]
fn sliders_in_a_browser() {
    let Some(browser) = Browser::start() else { return };
    let folder = tempdir().unwrap();
    let data = |file: &str| format!("{}/data/{file}", env!("CARGO_MANIFEST_DIR"));
    let map = data("env/spruit_sunrise_512.hdr");
    let page = report(folder.path(), &format!("histogram {map} --samples 20k,200k --height 128"), 0);
    browser.size(1280, 1200, false);
    browser.open(&page);
    browser.fits();
    let shown = || {
        browser.script("return [...document.querySelectorAll('.stop')].filter(s => s.offsetParent).map(s => s.dataset.name)")
    };
    assert_eq!(shown(), json!(["200,000 samples"]));
    browser.keys(".stops input[type=range]", "\u{e012}"); // arrow to the left
    assert_eq!(shown(), json!(["20,000 samples"]));
    assert_eq!(
        browser.script("return document.querySelector('.stops output').textContent"),
        "20,000 samples"
    );
    browser.screenshot("report-map.png");
    browser.is_quiet();

    let scene = fs::read_to_string(data("scene/cornell.toml")).unwrap();
    let scene =
        scene.replace("cornell_measured.obj", &data("scene/cornell_measured.obj")).replace("256", "64");
    fs::write(folder.path().join("stamp.toml"), scene).unwrap();
    let page =
        report(folder.path(), "converge stamp.toml --strategy light,brdf,mis:0.5 --spp 4 --seeds 2", 0);
    browser.open(&page);
    browser.fits();
    let state = "const o = document.querySelector('.compare .over'); return [o.style.clipPath, document.querySelector('.edge').style.left, o.alt, o.src.length > 100]";
    let before = browser.script(state);
    assert!(before[0].as_str().unwrap().contains("50%") && before[3] == true, "{before}");
    browser
        .script("document.querySelector('.compare').scrollIntoView({block: 'center', behavior: 'instant'})");
    browser.keys(".compare input[type=range]", "\u{e012}\u{e012}"); // two steps of a half
    let after = browser.script(state);
    assert!(
        after[0].as_str().unwrap().contains("51%") && after[1].as_str().unwrap().contains("49%"),
        "{after}"
    );
    // Another picture on the left.
    browser.keys(".compare select.left", "equal samples, 4 samples a pixel: brdf");
    let chosen = browser.script(state);
    assert!(
        chosen[2] != before[2] && chosen[2].as_str().unwrap().contains("by brdf at equal samples"),
        "{chosen}"
    );
    browser.screenshot("report-strategies.png");
    browser.size(390, 1400, true);
    browser.fits();
    browser.screenshot("report-strategies-phone.png");
    browser.is_quiet();
}
