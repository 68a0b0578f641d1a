//! Errors of a deck, shown in its text.

use std::fmt::{self, Write};
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ddem_core::{ErrorCode, Fault};
use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource};

use crate::reader::Source;
use crate::reader::{numbers, syntax};

/// Largest number of mistakes shown in the text: a table that a program wrote wrongly has one in
/// each row.
const SHOWN: usize = 20;

/// Largest number of mistakes listed without the text.
const LISTED: usize = 100;

/// Length of a line `[bytes]` above which its text is not shown: a program wrote it.
const LONGEST: usize = 1000;

/// Error of a deck that cannot be used.
///
/// Its display has a line for the deck and one for each mistake; [`report`](Self::report) shows the
/// text of the deck with each mistake underlined.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum DeckError {
    /// The file cannot be read.
    #[error("{}: {source} ({}) [{}]", unreadable(path), remedy(source), ErrorCode::InvalidFile)]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// Cause.
        source: io::Error,
    },
    /// A deck made by a program has a value that TOML cannot hold.
    #[error("the deck cannot be written as TOML: {message} [{}]", ErrorCode::InvalidArgument)]
    Unwritable {
        /// Reason.
        message: String,
    },
    /// Faults of the deck.
    #[error("{}{}", headline(name, findings), lines(findings))]
    Wrong {
        /// Name of the deck, usually the path of its file.
        name: String,
        /// Findings in the order of the text, at least one.
        findings: Vec<Finding>,
    },
}

ddem_core::debug_as_display!(DeckError);

/// Advice on a file that cannot be read.
fn remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::InvalidData => "save the file as UTF-8",
        io::ErrorKind::IsADirectory => "give the TOML file in the folder, not the folder",
        _ => "a deck is a TOML file",
    }
}

fn unreadable(path: &Path) -> String {
    format!("cannot read the deck `{}`", path.display())
}

fn headline(name: &str, findings: &[Finding]) -> String {
    match findings {
        [one] => format!("the deck `{name}` has a mistake in line {}", one.line),
        many => format!("the deck `{name}` has {} mistakes", many.len()),
    }
}

fn lines(findings: &[Finding]) -> String {
    let shown = findings.iter().take(LISTED).map(|finding| format!("\n{finding}"));
    let lines: String = shown.collect();
    match findings.len().saturating_sub(LISTED) {
        0 => lines,
        more => format!("{lines}\n… and {more} more"),
    }
}

/// Fault without control characters, which a key or a name of a deck may have and a terminal would obey.
fn printable(mut fault: Fault) -> Fault {
    let texts = [Some(&mut fault.message), Some(&mut fault.place), fault.help.as_mut()];
    for text in texts.into_iter().flatten() {
        if text.contains(is_control) {
            *text = text.replace(is_control, "\u{fffd}");
        }
    }
    fault
}

/// True for a character that moves a terminal's cursor or changes its colours.
pub(crate) fn is_control(letter: char) -> bool {
    letter.is_control() && !matches!(letter, '\n' | '\t')
}

impl DeckError {
    /// Error with the faults of a deck, located in its text.
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

    /// Code of the error; for findings it is the code of the first one.
    #[must_use]
    pub fn code(&self) -> ErrorCode {
        match self {
            Self::Unreadable { .. } => ErrorCode::InvalidFile,
            Self::Unwritable { .. } => ErrorCode::InvalidArgument,
            Self::Wrong { findings, .. } => {
                findings.first().map_or(ErrorCode::Syntax, |finding| finding.fault.code)
            }
        }
    }

    /// Findings in the order of the text; empty if there is no text.
    pub fn findings(&self) -> &[Finding] {
        match self {
            Self::Wrong { findings, .. } => findings,
            _ => &[],
        }
    }

    /// Text of the error with the wrong parts of the deck underlined, in colour for a terminal.
    ///
    /// It shows only the first of very many mistakes; [`findings`](Self::findings) has all.
    pub fn report(&self, colour: bool) -> String {
        let theme =
            if colour { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
        let handler = GraphicalReportHandler::new_themed(theme)
            .with_links(false)
            .with_width(100)
            .with_context_lines(1);
        let mut report = String::new();
        let rendered = match self {
            Self::Wrong { name, findings } => {
                report = format!("{}\n\n", headline(name, findings));
                let mut shown = findings.iter().take(SHOWN);
                let rendered = shown.try_for_each(|finding| match finding.is_in_long_line() {
                    true => writeln!(report, "{finding}\n"),
                    false => handler.render_report(&mut report, &InText(finding)),
                });
                if findings.len() > SHOWN {
                    report += &format!("\n… and {} more\n", findings.len() - SHOWN);
                }
                rendered
            }
            Self::Unreadable { path, source } => {
                handler.render_report(&mut report, &Unreadable { path, source })
            }
            Self::Unwritable { .. } => writeln!(report, "{self}"),
        };
        match rendered {
            Ok(()) => report,
            Err(fmt::Error) => self.to_string(),
        }
    }
}

/// One mistake, with its place in the text of the deck.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Finding {
    /// The fault.
    pub fault: Fault,
    /// Bytes of the text that are underlined.
    pub span: Range<usize>,
    /// Line of the text, from 1.
    pub line: usize,
    /// Column in the line, from 1, in characters.
    pub column: usize,
    text: NamedSource<Arc<str>>,
}

impl Finding {
    pub(crate) fn new(source: &Source, fault: Fault, span: Range<usize>) -> Self {
        let (name, text) = source.shared();
        let (line, column) = source.line_and_column(span.start);
        let fault = printable(fault);
        Self { fault, span, line, column, text: NamedSource::new(name, text) }
    }

    /// True if a line of the shown text is long.
    fn is_in_long_line(&self) -> bool {
        // The lines before and after are shown, too.
        let around = self.line.saturating_sub(2);
        self.text.inner().lines().skip(around).take(3).any(|line| line.len() > LONGEST)
    }

    /// Finding at the first place that is not TOML; later errors are often only its consequences.
    pub(crate) fn syntax(source: &Source, errors: &[toml::de::Error]) -> Option<Self> {
        let start = |error: &toml::de::Error| error.span().map_or(0, |span| span.start);
        let first = errors.iter().min_by_key(|error| start(error))?;
        let (text, at) = (source.text(), start(first));
        let mut fault = Fault::new(ErrorCode::Syntax, "", first.message());
        // A missing bracket is noticed at the end of the text, not where it is missing.
        let unclosed = errors.iter().find(|error| error.message().starts_with("unclosed"));
        let unclosed = unclosed.filter(|unclosed| start(unclosed) > at);
        let advice = match first.message() {
            "duplicate key" => syntax::twice(text, at),
            _ => syntax::advice(text, at),
        };
        if let Some(hint) = numbers::hint(numbers::word(text, at)) {
            fault = Fault::new(ErrorCode::Syntax, "", "this is not a number").help(hint);
        } else if let Some(unclosed) = unclosed {
            fault = fault.help(format!("before this there is an {}", unclosed.message()));
        } else if let Some((message, help)) = advice {
            fault = Fault::new(ErrorCode::Syntax, "", message).help(help);
        } else {
            fault = fault.help(syntax::LINES);
        }
        Some(Self::new(source, fault, first.span().unwrap_or(0..0)))
    }
}

/// Place, message and help on one line.
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}: {}", self.text.name(), self.line, self.column, self.fault)
    }
}

impl std::error::Error for Finding {}

/// A finding for display in its text.
#[derive(Debug)]
struct InText<'a>(&'a Finding);

impl fmt::Display for InText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Fault { code, message, .. } = &self.0.fault;
        write!(f, "{message} [{code}]")
    }
}

impl std::error::Error for InText<'_> {}

impl Diagnostic for InText<'_> {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.0.fault.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        Some(&self.0.text)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let Finding { fault, span, .. } = self.0;
        let place = if fault.place.is_empty() { "here" } else { &fault.place };
        let label = LabeledSpan::new_with_span(Some(place.to_owned()), span.clone());
        Some(Box::new(std::iter::once(label)))
    }
}

/// A file that cannot be read, with the cause on a line of its own.
#[derive(Debug)]
struct Unreadable<'a> {
    path: &'a Path,
    source: &'a io::Error,
}

impl fmt::Display for Unreadable<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} [{}]", unreadable(self.path), ErrorCode::InvalidFile)
    }
}

impl std::error::Error for Unreadable<'_> {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        Some(self.source)
    }
}

impl Diagnostic for Unreadable<'_> {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(remedy(self.source)))
    }
}
