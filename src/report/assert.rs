//! The end of a test: passes silently, or fails with the whole story and pictures of it.

use crate::verify::{Report, Verdict};

impl Report {
    /// Panics with the whole story unless every sampler passed.
    ///
    /// With the feature `pictures`, observed, expected and residual of each sampler that did not pass are written to `warpcheck/` in cargo's target folder
    /// first, and the story says where.
    ///
    /// # Panics
    /// If the verdict is fail or inconclusive.
    #[track_caller]
    pub fn assert(&self) {
        if self.verdict() != Verdict::Pass {
            panic!("\n{self}{}", pictures(self));
        }
    }
}

/// Writes the pictures of what did not pass, and says where they are.
#[cfg(feature = "pictures")]
fn pictures(report: &Report) -> String {
    let folder = target_folder().join("warpcheck");
    let mut said = String::new();
    for (i, examination) in report.examinations.iter().enumerate() {
        if report.verdict_on(i) == Verdict::Pass {
            continue;
        }
        let file = folder.join(format!("{}.png", crate::picture::file_stem(&examination.name)));
        let made = std::fs::create_dir_all(&folder).map_err(|error| error.to_string()).and_then(|()| {
            crate::picture::write_png(&file, &super::residual_sheet(report, i)).map_err(|e| e.to_string())
        });
        // A picture that can't be written must not hide the failure.
        said += &match made {
            Ok(()) => format!("  picture: {}\n", file.display()),
            Err(error) => format!("  no picture: {error}\n"),
        };
    }
    said
}

#[cfg(not(feature = "pictures"))]
fn pictures(_: &Report) -> String {
    String::new()
}

/// Cargo's target folder, as far as a running test can tell: as set, or the nearest one upward that cargo has marked.
#[cfg(feature = "pictures")]
fn target_folder() -> std::path::PathBuf {
    use std::path::PathBuf;
    if let Some(set) = std::env::var_os("CARGO_TARGET_DIR") {
        return set.into();
    }
    let here = std::env::current_dir().unwrap_or_default();
    let marked = |folder: &std::path::Path| folder.join("target").join("CACHEDIR.TAG").exists();
    here.ancestors()
        .find(|folder| marked(folder))
        .map_or_else(|| PathBuf::from("target"), |f| f.join("target"))
}
