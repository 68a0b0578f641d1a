//! What is wrong with a deck, shown in its text.

use std::fmt;
use std::io;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use ddem_core::Fault;
use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource};

use crate::deck::Source;
use crate::deck::numbers;

/// Mistakes that are shown in the text: a table that a program wrote wrong has one in each row.
const SHOWN: usize = 20;

/// A deck that cannot be used.
///
/// `{}` is one line; `{:#}` adds one line for each fault; [`report`](Self::report) shows the text
/// of the deck with each fault underlined.
#[derive(Debug, thiserror::Error, Diagnostic)]
#[non_exhaustive]
pub enum DeckError {
    /// The file cannot be read.
    #[error("cannot read the deck `{}`", .path.display())]
    #[diagnostic(help("a deck is a TOML file"))]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A deck made by a program has a value that TOML cannot hold.
    #[error("the deck cannot be written as TOML: {message}")]
    Unwritable {
        /// Why.
        message: String,
    },
    /// Something in the deck is wrong.
    #[error(fmt = summary)]
    Wrong {
        /// What the deck is called, usually the path of its file.
        name: String,
        /// What is wrong, in the order of the text; at least one.
        #[related]
        findings: Vec<Finding>,
    },
}

fn summary(name: &str, findings: &[Finding], f: &mut fmt::Formatter<'_>) -> fmt::Result {
    match findings {
        [one] => write!(f, "the deck `{name}` has a mistake in line {}", one.line)?,
        many => write!(f, "the deck `{name}` has {} mistakes", many.len())?,
    }
    if f.alternate() {
        for finding in findings {
            write!(f, "\n{name}:{}:{}: ", finding.line, finding.column)?;
            match finding.fault.place.as_str() {
                "" => write!(f, "{}", finding.fault.message)?,
                _ => write!(f, "{}", finding.fault)?,
            }
        }
    }
    Ok(())
}

impl DeckError {
    /// Faults found in a deck, located in its text.
    pub fn from_faults(source: &Source, faults: impl IntoIterator<Item = Fault>) -> Self {
        let located = faults.into_iter().map(|fault| {
            let span = source.locate(&fault.place);
            Finding::new(source, fault, span)
        });
        Self::wrong(source, located.collect())
    }

    pub(crate) fn wrong(source: &Source, mut findings: Vec<Finding>) -> Self {
        findings.sort_by_key(|finding| finding.span.start);
        Self::Wrong { name: source.name().to_owned(), findings }
    }

    /// What is wrong, in the order of the text; empty when there is no text.
    pub fn findings(&self) -> &[Finding] {
        match self {
            Self::Wrong { findings, .. } => findings,
            _ => &[],
        }
    }

    /// The error with the lines of the deck that are wrong, underlined; in colour for a terminal.
    ///
    /// Of very many it shows the first; [`findings`](Self::findings) has them all.
    pub fn report(&self, colour: bool) -> String {
        let theme =
            if colour { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
        let handler = GraphicalReportHandler::new_themed(theme)
            .with_links(false)
            .with_width(100)
            .with_context_lines(1);
        let mut report = String::new();
        let rendered = match self {
            Self::Wrong { findings, .. } => {
                report = format!("{self}\n\n");
                let mut shown = findings.iter().take(SHOWN);
                let rendered =
                    shown.try_for_each(|finding| handler.render_report(&mut report, finding));
                if findings.len() > SHOWN {
                    report += &format!("\n… and {} more\n", findings.len() - SHOWN);
                }
                rendered
            }
            _ => handler.render_report(&mut report, self),
        };
        match rendered {
            Ok(()) => report,
            Err(fmt::Error) => format!("{self:#}"),
        }
    }
}

/// One thing that is wrong, with its place in the text of the deck.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Finding {
    /// What is wrong.
    pub fault: Fault,
    /// Bytes of the text that are underlined.
    pub span: Range<usize>,
    /// Line of the text, from 1.
    pub line: usize,
    /// Column in the line, from 1, in letters.
    pub column: usize,
    text: NamedSource<Arc<str>>,
}

impl Finding {
    pub(crate) fn new(source: &Source, fault: Fault, span: Range<usize>) -> Self {
        let (name, text) = source.shared();
        let before = text.get(..span.start).unwrap_or_default();
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        Self { fault, span, line, column, text: NamedSource::new(name, text) }
    }

    /// The first place that is not TOML: what comes after it is often only its echo.
    pub(crate) fn syntax(source: &Source, errors: &[toml::de::Error]) -> Option<Self> {
        let start = |error: &toml::de::Error| error.span().map_or(0, |span| span.start);
        let first = errors.iter().min_by_key(|error| start(error))?;
        let mut fault = Fault::new("", first.message());
        // The end of the text is where a missing bracket is noticed, not where it is missing.
        let unclosed = errors.iter().find(|error| error.message().starts_with("unclosed"));
        if let Some(hint) = numbers::hint(numbers::word(source.text(), start(first))) {
            fault = Fault::new("", "this is not a number").help(hint);
        } else if let Some(unclosed) = unclosed.filter(|unclosed| start(unclosed) > start(first)) {
            fault = fault.help(format!("before this there is an {}", unclosed.message()));
        }
        Some(Self::new(source, fault, first.span().unwrap_or(0..0)))
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.fault.message)
    }
}

impl std::error::Error for Finding {}

impl Diagnostic for Finding {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.fault.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        Some(&self.text)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let place = if self.fault.place.is_empty() { "here" } else { &self.fault.place };
        let label = LabeledSpan::new_with_span(Some(place.to_owned()), self.span.clone());
        Some(Box::new(std::iter::once(label)))
    }
}
