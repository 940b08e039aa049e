//! A run as a page for the browser: one file, which needs no network and opens from the disk.
//!
//! A [`Page`] is a head (verdict, facts) and [`Section`]s of [`Block`]s: words, tables, figures that zoom together, sliders, plots. What
//! runs found is put onto it by its methods, [`Page::verify`] and others, in any number and order; [`Page::render`] makes the text, from the template beside this
//! file. Tables sort and sliders move by a script within the page; without it, and on paper, everything is shown.
//!
//! ```
//! use warpcheck::report::html::Page;
//! use warpcheck::sampler::UniformSphere;
//! let report = warpcheck::verify(&UniformSphere).name("mine").samples(50_000).run();
//! let mut page = Page::new("my renderer's samplers");
//! page.verify(&report, |name| format!("cargo test {name}"));
//! assert!(page.render().contains("my renderer"));
//! # let folder = tempfile::tempdir()?;
//! page.write(folder.path())?; // index.html
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[cfg(feature = "render")]
mod environment;
mod figure;
mod line_plot;
mod page;
#[cfg(feature = "render")]
mod pictures;
mod tables;
mod verify;

#[cfg(feature = "render")]
pub use environment::EnvironmentStop;
pub use figure::Figure;
pub use page::{Block, Cell, Column, Failure, GENERATOR, Page, Row, Section, Table};
#[cfg(feature = "render")]
pub use pictures::Group;
