//! The page: well-formed, whole, safe, and in the right order.

use assert_cmd::cargo::cargo_bin;
use glam::{Vec2, Vec3};
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::tempdir;
use warpcheck::domain::{Hemisphere, Square};
use warpcheck::report::html::Page;
use warpcheck::sampler::{CosineHemisphere, UniformHemisphere, from_fn};
use warpcheck::verify::{Report, Settings, verify};

/// Every element is closed, in order; returns how many elements there are. Styles, scripts and comments are passed over.
fn well_formed(page: &str) -> usize {
    const VOID: [&str; 7] = ["meta", "link", "img", "input", "br", "line", "path"];
    let mut open: Vec<&str> = Vec::new();
    let mut elements = 0;
    let mut rest =
        page.strip_prefix("<!DOCTYPE html>").or(page.trim_start().strip_prefix("<!DOCTYPE html>")).unwrap();
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        // Up to the end of the tag, over quoted values.
        let mut quote = None;
        let end = rest
            .char_indices()
            .find(|&(_, c)| match quote {
                Some(q) if c == q => {
                    quote = None;
                    false
                }
                Some(_) => false,
                None if c == '"' || c == '\'' => {
                    quote = Some(c);
                    false
                }
                None => c == '>',
            })
            .unwrap_or_else(|| panic!("a tag without end: {:.80}", rest))
            .0;
        let (tag, after) = (&rest[..end], &rest[end + 1..]);
        rest = after;
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(
                open.pop(),
                Some(name.trim()),
                "</{name}> closes nothing that is open; before {:.200}",
                rest
            );
            continue;
        }
        let name = tag.split([' ', '\n', '/']).next().unwrap();
        elements += 1;
        if tag.ends_with('/') || VOID.contains(&name) {
            continue;
        }
        if name == "script" || name == "style" {
            let close = format!("</{name}>");
            rest = &rest[rest.find(&close).unwrap() + close.len()..];
            continue;
        }
        open.push(name);
    }
    assert_eq!(open, [""; 0], "never closed");
    elements
}

/// Nothing is loaded from anywhere: what has an address is a place on the page or data.
#[track_caller]
fn self_contained(page: &str) {
    let mut found = 0;
    for attribute in [" src=\"", " href=\""] {
        for (at, _) in page.match_indices(attribute) {
            let address = &page[at + attribute.len()..];
            assert!(address.starts_with('#') || address.starts_with("data:"), "{:.80}", address);
            found += 1;
        }
    }
    assert!(found > 1);
    for loader in ["@import", "url(", "fetch(", "XMLHttpRequest", "<iframe", "<object", "<base"] {
        assert!(!page.contains(loader), "{loader}");
    }
    // The namespace of SVG is a name, not an address.
    let others = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!others.contains("http:") && !others.contains("https:"));
}

fn settings() -> Settings {
    Settings { samples: 20_000, ..Settings::default() }
}

/// One that is right, and one that is wrong.
fn report(right: &str, wrong: &str) -> Report {
    let broken =
        from_fn(Hemisphere, |xi: Vec2| UniformHemisphere.sample(xi), |w: Vec3| CosineHemisphere.density(w));
    Report::new(
        vec![
            verify(&CosineHemisphere).name(right).settings(settings()).examine(),
            verify(&broken).name(wrong).settings(settings()).examine(),
        ],
        &settings(),
    )
}

#[test]
fn failures_come_first_with_diagnosis_and_replay() {
    let mut page = Page::new("two lobes");
    page.verify(&report("a right lobe", "b wrong lobe"), |name| format!("replay {name} now"));
    let text = page.render();
    assert!(well_formed(&text) > 200);
    self_contained(&text);
    let place = |words: &str| text.find(words).unwrap_or_else(|| panic!("{words}"));
    assert!(!text.contains("{{") && !text.contains("{%"), "template left over");
    assert!(place(" fail</span>") < place("a right lobe"));
    // In the list of failures, in the table, in the sections.
    let card = place("<article class=\"card fail\">");
    assert!(card < place("<table") && text[card..].contains("replay b wrong lobe now"));
    assert!(text[card..place("<table")].contains("cos theta"), "the diagnosis in words");
    let body = &text[place("<tbody>")..];
    assert!(body.find("b wrong lobe").unwrap() < body.find("a right lobe").unwrap());
    let sections: Vec<usize> =
        ["id=\"sampler-b-wrong-lobe\"", "id=\"sampler-a-right-lobe\""].map(place).into();
    assert!(sections[0] < sections[1]);
    // The wrong one is open, the right one closed.
    assert!(
        text.contains("id=\"sampler-b-wrong-lobe\" open")
            && !text.contains("id=\"sampler-a-right-lobe\" open")
    );
    for (name, _) in warpcheck::verify::checks().filter(|(name, _)| *name != "round trip") {
        assert!(text.contains(name), "{name}");
    }
    for word in [
        "<dd>20,000</dd>",
        "0.001 of runs",
        "edge probes: 28 of 28",
        "million samples a second",
        "(observed − expected)",
    ] {
        assert!(text.contains(word), "{word}");
    }
    // Every picture says what it shows.
    let alts = text.matches(" alt=\"").count();
    assert_eq!(text.matches("<img src=").count(), text.matches("<img src=\"data:image/png;base64,").count());
    assert!(alts >= 6 && text.matches(" alt=\"\"").count() == text.matches("class=\"viewer\"").count() * 2);
}

#[test]
fn names_are_text_and_nothing_else() {
    let wicked = "<script>alert('x')</script> & \"q\" </style>{{ 7 * 7 }}";
    let mut page = Page::new(wicked);
    page.verify(&report(wicked, "</script><img src=x onerror=alert(1)>"), |name| format!("verify '{name}'"));
    page.fact(wicked, wicked).says(wicked);
    let text = page.render();
    well_formed(&text);
    self_contained(&text);
    assert!(!text.contains("<script>alert") && !text.contains("<img src=x"));
    assert!(text.contains("&lt;script&gt;alert(") && text.contains("{{ 7 * 7 }}"));
    assert_eq!(text.matches("</style>").count(), 1);
}

#[test]
fn strips_and_what_has_no_cells_have_a_page_too() {
    let rejecting = from_fn(Square, |_: [f64; 2]| None::<[f64; 2]>, |_: [f64; 2]| 1.0);
    let examinations = vec![
        verify(&rejecting).name("nothing").settings(settings()).examine(),
        verify(&warpcheck::sampler::DiscreteCdf::new(&[1.0, 0.0, 3.0]).unwrap())
            .name("table")
            .settings(settings())
            .examine(),
    ];
    let mut page = Page::new("odd ones");
    page.verify(&Report::new(examinations, &settings()), ToOwned::to_owned);
    let text = page.render();
    well_formed(&text);
    self_contained(&text);
    // A page without anything on it is a page.
    well_formed(&Page::new("empty").render());
}

fn warpcheck(folder: &Path, words: &str) -> Output {
    let mut command = Command::new(cargo_bin!("warpcheck"));
    command.current_dir(folder).args(words.split_whitespace()).stdin(Stdio::null()).output().unwrap()
}

#[test]
fn every_command_makes_one() {
    let folder = tempdir().unwrap();
    let data = |file: &str| format!("{}/data/{file}", env!("CARGO_MANIFEST_DIR"));
    let scene = fs::read_to_string(data("scene/cornell.toml")).unwrap();
    let scene =
        scene.replace("cornell_measured.obj", &data("scene/cornell_measured.obj")).replace("256", "16");
    fs::write(folder.path().join("stamp.toml"), scene).unwrap();
    let map = data("env/noon_grass_512.hdr");
    for (words, has) in [
        ("verify triangle/low-distortion --samples 5k", &["1 of 1 samplers pass", "Samplers by checks"][..]),
        (
            "histogram triangle/low-distortion --samples 1k,5k --height 32",
            &["1,000 samples", "5,000 samples", "density per area"],
        ),
        (
            &format!("histogram {map} --samples 1k,2k --height 32"),
            &["importance", "type=\"range\"", "the first 1,500"],
        ),
        (
            "render stamp.toml --strategy light,brdf --spp 1,4",
            &["1 sample a pixel", "4 samples a pixel: standard error", "class=\"over\"", "emitter table"],
        ),
        (
            "converge stamp.toml --strategy light,brdf --spp 4 --seeds 2",
            &["equal time, ", "equal samples, 4 samples a pixel: error", "<svg", "whole picture"],
        ),
        (
            "agree stamp.toml --strategy light,brdf --spp 32 --allow-inconclusive",
            &["of 1 pairs of estimates", "the least channel"],
        ),
        ("stress mixture --quick", &["rows are as they should be", "what happened"]),
        ("faults triangle/branch-squared --seeds 1 --samples 2k", &["Caught 1 of 1", "xi0 &lt; xi1"]),
        ("plan stamp.toml", &["left out", "environment map"]),
        (
            "calibrate triangle/low-distortion --runs 4 --samples 1k --peeking 17k",
            &["Rates of false alarms", "<svg"],
        ),
    ] {
        let output = warpcheck(folder.path(), &format!("{words} --report page"));
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{words}: {said} {}", String::from_utf8_lossy(&output.stderr));
        assert!(said.contains("report: page/index.html"), "{words}: {said}");
        let text = fs::read_to_string(folder.path().join("page/index.html")).unwrap();
        assert!(well_formed(&text) > 20, "{words}");
        self_contained(&text);
        assert!(text.len() < 3_000_000, "{words}: {} bytes", text.len());
        for words in has.iter().copied().chain(["<dt>command</dt>", "time of the whole run"]) {
            assert!(text.contains(words), "{words}");
        }
        // One sample says nothing about its error.
        assert!(!text.contains("1 sample a pixel: standard error"), "{words}");
    }
}

#[test]
fn somebody_elses_page_is_left_alone() {
    let folder = tempdir().unwrap();
    fs::create_dir(folder.path().join("site")).unwrap();
    fs::write(folder.path().join("site/index.html"), "<p>my site</p>").unwrap();
    let output = warpcheck(folder.path(), "verify triangle --samples 1k --report site");
    assert_eq!(output.status.code(), Some(2));
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(
        told.contains("site/index.html was not made by warpcheck") && told.lines().count() == 1,
        "{told}"
    );
    assert_eq!(fs::read_to_string(folder.path().join("site/index.html")).unwrap(), "<p>my site</p>");
}

#[test]
fn shells_and_man_are_told() {
    let folder = tempdir().unwrap();
    let said = |words: &str| {
        let output = warpcheck(folder.path(), words);
        assert!(output.status.success() && output.stderr.is_empty(), "{words}: {output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let text = said(&format!("completions {shell}"));
        assert!(
            ["converge", "allow-inconclusive", "report"].iter().all(|word| text.contains(word)),
            "{shell}"
        );
    }
    let page = said("man");
    assert!(page.contains(".TH warpcheck 1") && page.contains("converge"), "{page}");
    let page = said("man verify");
    assert!(page.contains(".TH warpcheck-verify 1") || page.contains(".TH warpcheck\\-verify 1"), "{page}");
    assert!(page.contains("anytime"));
    assert_eq!(warpcheck(folder.path(), "man nothing").status.code(), Some(2));
}

#[test]
fn power_at_any_error_is_that_of_the_table() {
    let report = report("right", "wrong");
    let e = &report.examinations[0];
    let level = report.level();
    let power = e.power(level);
    assert_eq!(power.len(), 4);
    for p in power {
        let at = |error: f64| e.power_against(level, p.mass, error).unwrap();
        // Either the cells or the windows have 0.99 there; the better of both, no less.
        assert!((0.985..0.9999).contains(&at(p.error)), "{p:?}: {}", at(p.error));
        assert!(at(0.0) < 1e-3 && at(0.5 * p.error) < 0.8 && at(2.0 * p.error) > 0.9999, "{p:?}");
        let path: Vec<f64> = (0..20).map(|k| at(p.error * f64::from(k) / 10.0)).collect();
        assert!(path.is_sorted(), "{path:?}");
    }
    let anytime = verify(&CosineHemisphere).anytime().samples(20_000).run();
    assert_eq!(anytime.examinations[0].power_against(level, 0.05, 0.1), None);
    // 1 / e-values: at every doubling, and in the end.
    let looks = &anytime.examinations[0].history;
    assert_eq!(looks.iter().map(|l| l.samples).collect::<Vec<_>>(), [16_384, 20_000]);
    assert!(looks.iter().all(|l| l.p > 1e-3 && l.p <= 1.0), "{looks:?}");
}
