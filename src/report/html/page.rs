//! The page: what it is made of, and how it becomes text.

use super::figure::{Figure, gradients};
use crate::picture::{Error, write_atomically};
use crate::verify::Verdict;
use minijinja::syntax::SyntaxConfig;
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, Value, context};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What the page says it was made by; by this a page of ours is told from anybody else's.
pub const GENERATOR: &str = "<meta name=\"generator\" content=\"warpcheck ";

/// A page under construction.
#[derive(Clone, Debug, Serialize)]
pub struct Page {
    title: String,
    /// `pass`, `inconclusive` or `fail`; nothing where nothing is judged.
    verdict: Option<String>,
    #[serde(skip)]
    worst: Option<Verdict>,
    /// A sentence a run.
    pub(super) summary: Vec<String>,
    facts: Vec<(String, String)>,
    sections: Vec<Section>,
}

/// A part of the page with a heading.
#[derive(Clone, Debug, Serialize)]
pub struct Section {
    pub(super) id: String,
    pub(super) title: String,
    /// What the bar of links calls it.
    pub(super) short: String,
    pub(super) status: Option<String>,
    /// Beside the heading, small.
    pub(super) aside: String,
    /// One that opens and closes, and whether it is open; `None` for one that is always open.
    pub(super) open: Option<bool>,
    pub(super) blocks: Vec<Block>,
}

/// A piece of a section.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Block {
    /// A paragraph.
    Words {
        /// The paragraph.
        text: String,
    },
    /// Text as a terminal shows it.
    Text {
        /// The text.
        text: String,
    },
    /// A line to be copied into a shell.
    Command {
        /// The line.
        line: String,
    },
    /// What did not pass, in words.
    Failures {
        /// Each of them.
        items: Vec<Failure>,
        /// How many more there are.
        more: usize,
    },
    /// Items with a status each.
    List {
        /// Status (may be empty) and text.
        items: Vec<(String, String)>,
    },
    /// A table.
    Table(Table),
    /// Figures side by side.
    Figures {
        /// The figures.
        figures: Vec<Figure>,
        /// Whether they zoom together.
        zoom: bool,
        /// What is shown where the pointer is: JSON.
        hover: Option<String>,
    },
    /// Figures, some for each stop of a slider.
    Stops {
        /// What the slider changes.
        label: String,
        /// The name of each stop, and its figures.
        stops: Vec<(String, Vec<Figure>)>,
    },
    /// Figures of equal size, any two of which can be laid over one another.
    Compare {
        /// Groups: name, note, figures.
        groups: Vec<(String, String, Vec<Figure>)>,
    },
    /// Plots side by side.
    Plots {
        /// Text of the SVG, and what it shows in words.
        plots: Vec<(String, String)>,
    },
    /// More, to be opened.
    More {
        /// What there is.
        summary: String,
        /// It.
        blocks: Vec<Block>,
    },
    /// Shares of a whole: name, share in [0, 1], figure.
    Bars {
        /// What it is the whole of.
        label: String,
        /// Name, share, figure.
        bars: Vec<(String, f64, String)>,
    },
}

/// Something that did not pass.
#[derive(Clone, Debug, Serialize)]
pub struct Failure {
    /// Its name.
    pub name: String,
    /// The section that has more.
    pub id: String,
    /// `fail` or `inconclusive`.
    pub status: String,
    /// The diagnosis.
    pub says: String,
    /// The checks that said so.
    pub checks: String,
    /// The line that shows it again.
    pub replay: String,
}

/// A table that sorts by any of its columns.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// The columns.
    pub columns: Vec<Column>,
    /// The rows.
    pub rows: Vec<Row>,
    /// Whether its rows can be filtered by words and by verdict.
    pub filter: bool,
}

/// The head of a column.
#[derive(Clone, Debug, Serialize)]
pub struct Column {
    name: String,
    about: String,
    numeric: bool,
}

impl Column {
    /// Of words.
    pub fn words(name: impl Into<String>) -> Self {
        Self { name: name.into(), about: String::new(), numeric: false }
    }

    /// Of numbers.
    pub fn numbers(name: impl Into<String>) -> Self {
        Self { numeric: true, ..Self::words(name) }
    }

    /// With what it means, for those who point at it.
    pub fn about(mut self, about: impl Into<String>) -> Self {
        self.about = about.into();
        self
    }
}

/// A row.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub(super) status: Option<String>,
    pub(super) cells: Vec<Cell>,
}

impl Row {
    /// A row of cells.
    pub fn new(cells: impl IntoIterator<Item = Cell>) -> Self {
        Self { status: None, cells: cells.into_iter().collect() }
    }

    /// With a verdict, by which rows are filtered.
    pub fn judged(mut self, verdict: Verdict) -> Self {
        self.status = Some(verdict.to_string());
        self
    }
}

/// A cell.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Cell {
    pub(super) text: String,
    pub(super) status: Option<String>,
    /// What it is sorted by, if not by its text.
    pub(super) sort: Option<String>,
    pub(super) about: String,
    pub(super) link: Option<String>,
}

impl Cell {
    /// Words.
    pub fn new(text: impl Into<String>) -> Self {
        Self { text: text.into(), ..Self::default() }
    }

    /// A number, written as `text`.
    pub fn number(value: f64, text: impl Into<String>) -> Self {
        // What is no number comes last.
        let sort = if value.is_nan() { "Infinity".to_owned() } else { format!("{value:e}") };
        Self { sort: Some(sort.replace("inf", "Infinity")), ..Self::new(text) }
    }

    /// A verdict.
    pub fn verdict(verdict: Verdict, text: impl Into<String>) -> Self {
        Self { status: Some(verdict.to_string()), ..Self::new(text) }
    }

    /// With more for those who point at it.
    pub fn about(mut self, about: impl Into<String>) -> Self {
        self.about = about.into();
        self
    }

    /// Leads to a section.
    pub fn link(mut self, id: impl Into<String>) -> Self {
        self.link = Some(format!("#{}", id.into()));
        self
    }
}

impl Section {
    /// A section with a heading; the id is what links lead to.
    pub fn new(id: impl Into<String>, title: impl Into<String>) -> Self {
        let title = title.into();
        Self {
            id: id.into(),
            short: title.clone(),
            title,
            status: None,
            aside: String::new(),
            open: None,
            blocks: Vec::new(),
        }
    }

    /// Called so by the bar of links.
    pub fn short(mut self, short: impl Into<String>) -> Self {
        self.short = short.into();
        self
    }

    /// With a block more.
    pub fn with(mut self, block: Block) -> Self {
        self.blocks.push(block);
        self
    }
}

impl Page {
    /// An empty page.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            verdict: None,
            worst: None,
            summary: Vec::new(),
            facts: Vec::new(),
            sections: Vec::new(),
        }
    }

    /// With a verdict; of several the worst counts.
    pub fn judged(&mut self, verdict: Verdict) -> &mut Self {
        self.worst = self.worst.max(Some(verdict));
        self.verdict = self.worst.map(|v| v.to_string());
        self
    }

    /// With a fact in the head: the seed, say.
    pub fn fact(&mut self, name: impl Into<String>, value: impl Into<String>) -> &mut Self {
        self.facts.push((name.into(), value.into()));
        self
    }

    /// With a sentence under the title.
    pub fn says(&mut self, sentence: impl Into<String>) -> &mut Self {
        self.summary.push(sentence.into());
        self
    }

    /// With a section more.
    pub fn section(&mut self, section: Section) -> &mut Self {
        self.sections.push(section);
        self
    }

    /// The text of the page.
    ///
    /// # Panics
    /// Never: the template is part of the program, and the tests render every block of it.
    pub fn render(&self) -> String {
        let mut environment = Environment::new();
        environment.set_auto_escape_callback(|_| AutoEscape::Html);
        let syntax = SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build();
        environment.set_syntax(syntax.expect("the usual delimiters"));
        environment.add_template("page", include_str!("page.html")).expect("a template of our own");
        let style = format!("{}\n{}", include_str!("style.css"), gradients());
        let page = environment.get_template("page").and_then(|template| {
            template.render(context! {
                page => Value::from(Serde(self)),
                style => style,
                script => include_str!("script.js"),
                generator => GENERATOR,
                version => env!("CARGO_PKG_VERSION"),
            })
        });
        page.expect("a template of our own")
    }

    /// Writes `index.html` into a folder that is there, whole or not at all, and returns where.
    ///
    /// # Errors
    /// If it can't be written.
    pub fn write(&self, folder: &Path) -> Result<PathBuf, Error> {
        let file = folder.join("index.html");
        let text = self.render();
        write_atomically(&file, |out| out.write_all(text.as_bytes()))?;
        Ok(file)
    }
}

/// A name as an id: what is no letter or digit becomes a dash.
pub(super) fn id(prefix: &str, name: &str) -> String {
    format!("{prefix}-{}", crate::picture::file_stem(name).replace('.', "_"))
}
