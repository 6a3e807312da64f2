//! Finds the instances of a text, statement by statement, in all of its sections and editions.
//!
//! Text after `END-ISO-10303-21;` is not read, unless another exchange structure begins there. The instances are in file order.
//! Instances that the `REFERENCE` section assigns to other files are listed, too. Instances that do not parse are lost entities.
//! No parameter is read here.

use super::keyword::Keyword;
use super::params::parse_id;
use super::record::{ExchangeError, Record};
use super::scan::{ScanError, skip_blank, skip_list, skip_name, skip_resource, skip_string};
use crate::model::{LostEntity, LostKind};

/// What an exchange structure begins and ends with, and what both have in common.
const BEGIN: &[u8] = b"ISO-10303-21";
const END: &[u8] = b"END-ISO-10303-21";
const MARK: &[u8] = b"-10303-21";

/// What stands in the sections of a text.
pub(super) struct Records {
    /// In file order.
    pub(super) instances: Vec<Record>,
    /// The number of each instance that stands in another file, and where the text names that file.
    pub(super) elsewhere: Vec<(u64, u32)>,
}

/// What begins with `#` and a number.
enum Statement {
    Instance(Record),
    /// `#1=&SCOPE`: the instances up to its `ENDSCOPE` belong to the instance with this number.
    Scope(u64),
    /// `#1=<file.stp#anchor>;`, at the `<`.
    Elsewhere(u64, u32),
}

/// Finds the instances of all data sections.
pub(super) fn scan_records(
    text: &[u8],
    max_entities: u64,
    lost: &mut Vec<LostEntity>,
) -> Result<Records, ExchangeError> {
    let mut pass = Pass::over(text, lost);
    let mut at = skip_blank(text, 0);
    while let Some(&byte) = text.get(at) {
        at = match byte {
            b'#' => pass.take(at, at, scan_statement(text, at)),
            b'E' | b'e' if is_end_of_scope(text, at) => pass.end_of_scope(at),
            b'E' | b'e' if is_end_of_structure(text, at) => {
                at = skip_to_next_structure(text, at, pass.lost);
                continue;
            }
            _ => {
                at = skip_blank(text, skip_statement(text, at));
                continue;
            }
        };
        if pass.n_found() > max_entities {
            return Err(ExchangeError::TooManyEntities);
        }
        at = skip_blank(text, at);
    }
    Ok(pass.finish())
}

/// A statement with the position behind it, or why it breaks off and where.
type ScanResult = Result<(Statement, usize), (ScanError, usize)>;

/// One pass over a text.
struct Pass<'t, 'l> {
    text: &'t [u8],
    records: Records,
    lost: &'l mut Vec<LostEntity>,
    /// The instances whose scopes are open, each with the position where it begins.
    open_scopes: Vec<(u64, usize)>,
    /// Bytes read again behind damaged instances; no more than the text has, so that the pass stays linear.
    n_reread: usize,
}

impl<'t, 'l> Pass<'t, 'l> {
    fn over(text: &'t [u8], lost: &'l mut Vec<LostEntity>) -> Self {
        Self {
            text,
            records: Records {
                // Real files have about 60 bytes an instance.
                instances: Vec::with_capacity(text.len() / 48),
                elsewhere: Vec::new(),
            },
            lost,
            open_scopes: Vec::new(),
            n_reread: 0,
        }
    }

    /// Reads the end of a scope, which ends the statement of the instance that opened it.
    fn end_of_scope(&mut self, at: usize) -> usize {
        let scope = self.open_scopes.pop();
        let named_at = scope.map_or(at, |(_, begin)| begin);
        self.take(at, named_at, scan_end_of_scope(self.text, at, scope))
    }

    /// Keeps what a statement says, and returns where to read on. The instance has its number at `named_at`.
    #[inline]
    fn take(&mut self, begin: usize, named_at: usize, statement: ScanResult) -> usize {
        match statement {
            Ok((Statement::Instance(record), end)) => {
                self.records.instances.push(record);
                end
            }
            Ok((Statement::Scope(id), end)) => {
                self.open_scopes.push((id, begin));
                end
            }
            Ok((Statement::Elsewhere(id, position), end)) => {
                self.records.elsewhere.push((id, position));
                end
            }
            Err((error, stop)) => {
                self.lost.push(loss(self.text, named_at, error));
                self.after_damage(begin, stop)
            }
        }
    }

    /// Where to read on behind a damaged instance that begins at one position and breaks off at another.
    fn after_damage(&mut self, begin: usize, stop: usize) -> usize {
        let next = next_record(self.text, begin + 1);
        // A damaged instance does not hide the end of its structure.
        let next = find_statement(&self.text[..next], begin + 1, END).unwrap_or(next);
        self.n_reread += stop.saturating_sub(next);
        if self.n_reread <= self.text.len() {
            next
        } else {
            next.max(stop)
        }
    }

    fn n_found(&self) -> u64 {
        (self.records.instances.len() + self.lost.len()) as u64
    }

    /// What was found; scopes that are still open are lost.
    fn finish(self) -> Records {
        let open = self.open_scopes.into_iter();
        self.lost
            .extend(open.map(|(_, begin)| loss(self.text, begin, ScanError::OpenScope)));
        self.records
    }
}

/// Scans what begins with `#`, and gives the position behind it, or where it breaks off.
#[inline]
fn scan_statement(text: &[u8], at: usize) -> ScanResult {
    let (id, end) = parse_id(text, at + 1).ok_or_else(|| (error_of_id(text, at + 1), at + 1))?;
    let equals = skip_blank(text, end);
    if text.get(equals) != Some(&b'=') {
        return Err((ScanError::NoInstance, equals));
    }
    let start = skip_blank(text, equals + 1);
    match text.get(start) {
        Some(b'&') => {
            let name = skip_blank(text, start + 1);
            let end = skip_name(text, name);
            let is_scope = text[name..end].eq_ignore_ascii_case(b"SCOPE");
            if is_scope {
                Ok((Statement::Scope(id), end))
            } else {
                Err((ScanError::NoInstance, end))
            }
        }
        Some(b'<') => Ok((
            Statement::Elsewhere(id, start as u32),
            skip_statement(text, start),
        )),
        _ => scan_instance(text, id, start),
    }
}

/// Scans `CLASS(…);` or `(A(…)B(…));`.
#[inline]
fn scan_instance(
    text: &[u8],
    id: u64,
    start: usize,
) -> Result<(Statement, usize), (ScanError, usize)> {
    let name_end = skip_name(text, start);
    let list = skip_blank(text, name_end);
    if text.get(list) != Some(&b'(') {
        return Err((ScanError::NoInstance, list));
    }
    let list_end = skip_list(text, list)?;
    let end = skip_blank(text, list_end);
    let keyword = if name_end == start {
        keyword_of_complex(text, list)
    } else {
        Keyword::from_name(&text[start..name_end])
    };
    let n_name = u8::try_from(name_end - start).unwrap_or(u8::MAX);
    let record = Record {
        id,
        at: start as u32,
        keyword,
        n_name,
    };
    // A missing semicolon is forgiven: the next instance shows where this one ends.
    Ok((
        Statement::Instance(record),
        end + usize::from(text.get(end) == Some(&b';')),
    ))
}

/// A context is a context whatever other classes it has: files have thousands, and nobody has to look into them.
fn keyword_of_complex(text: &[u8], at: usize) -> Keyword {
    let start = skip_blank(text, at + 1);
    match Keyword::from_name(&text[start..skip_name(text, start)]) {
        Keyword::Context => Keyword::Context,
        _ => Keyword::Complex,
    }
}

fn is_end_of_scope(text: &[u8], at: usize) -> bool {
    text[at..skip_name(text, at)].eq_ignore_ascii_case(b"ENDSCOPE")
}

fn is_end_of_structure(text: &[u8], at: usize) -> bool {
    text[at..skip_name(text, at)].eq_ignore_ascii_case(END)
}

/// Skips what stands between two exchange structures, or behind the last one. Instances there are named, for nobody writes them
/// on purpose.
fn skip_to_next_structure(text: &[u8], at: usize, lost: &mut Vec<LostEntity>) -> usize {
    let behind = skip_name(text, at);
    let next = find_statement(text, behind, BEGIN).unwrap_or(text.len());
    let left_out = next_record(&text[..next], behind);
    if let Some((id, _)) =
        parse_id(text, left_out + 1).filter(|_| scan_statement(text, left_out).is_ok())
    {
        let reason =
            "it stands behind `END-ISO-10303-21;`, where the file ends, and is not read; nor is what follows it"
                .to_owned();
        lost.push(LostEntity {
            kind: LostKind::Entity,
            step_id: id,
            reason,
        });
    }
    next
}

/// The next position where a line or a statement begins with this name and nothing but a semicolon follows.
fn find_statement(text: &[u8], from: usize, name: &[u8]) -> Option<usize> {
    let mut at = from;
    while let Some(offset) = memchr::memmem::find(text.get(at..)?, MARK) {
        let end = at + offset + MARK.len();
        let begin = end.checked_sub(name.len()).filter(|&begin| begin >= from);
        let is_here = |begin: &usize| {
            let before = text[..*begin]
                .iter()
                .rev()
                .find(|byte| !matches!(byte, b' ' | b'\t'));
            text[*begin..end].eq_ignore_ascii_case(name)
                && matches!(
                    before,
                    None | Some(b'\n' | b'\r' | b'\0' | b';' | b'/' | 0x80..)
                )
                && text.get(skip_blank(text, end)) == Some(&b';')
        };
        if let Some(begin) = begin.filter(is_here) {
            return Some(begin);
        }
        at = end;
    }
    None
}

/// Scans `ENDSCOPE /#1,#2/ CLASS(…);`: the instance whose scope ends. What it exports is known here anyway.
fn scan_end_of_scope(text: &[u8], at: usize, scope: Option<(u64, usize)>) -> ScanResult {
    let (id, _) = scope.ok_or((ScanError::NoScope, at))?;
    let mut start = skip_blank(text, skip_name(text, at));
    if text.get(start) == Some(&b'/') {
        let end = text[start + 1..]
            .iter()
            .position(|&byte| matches!(byte, b'/' | b';' | b'('));
        let end = end.map_or(text.len(), |offset| start + 1 + offset);
        if text.get(end) != Some(&b'/') {
            return Err((ScanError::NoInstance, end));
        }
        start = skip_blank(text, end + 1);
    }
    scan_instance(text, id, start)
}

/// The next position where a line, a statement or nothing but blanks begins with `#`.
fn next_record(text: &[u8], mut at: usize) -> usize {
    while let Some(offset) = text[at..].iter().position(|&byte| byte == b'#') {
        at += offset;
        let before = text[..at]
            .iter()
            .rev()
            .find(|byte| !matches!(byte, b' ' | b'\t'));
        if matches!(before, Some(b'\n' | b'\r' | b';')) {
            return at;
        }
        at += 1;
    }
    text.len()
}

/// Skips a statement that is not an instance: a section's name, an entity of the header, an anchor.
fn skip_statement(text: &[u8], mut at: usize) -> usize {
    while let Some(&byte) = text.get(at) {
        match byte {
            b';' => return at + 1,
            b'\'' => {
                let end = skip_string(text, at).unwrap_or(text.len());
                // An apostrophe too many shows here, before it swallows the sections that follow.
                if !matches!(
                    text.get(skip_blank(text, end)),
                    Some(b',' | b')' | b';' | b'}')
                ) {
                    return next_record(text, at);
                }
                at = end;
            }
            b'<' => at = skip_resource(text, at),
            b'/' if text.get(at + 1) == Some(&b'*') => at = skip_blank(text, at),
            _ => at += 1,
        }
    }
    at
}

fn error_of_id(text: &[u8], at: usize) -> ScanError {
    if text.get(at).is_some_and(u8::is_ascii_digit) {
        ScanError::LargeId
    } else {
        ScanError::NoInstance
    }
}

fn loss(text: &[u8], at: usize, error: ScanError) -> LostEntity {
    let step_id = parse_id(text, at + 1).map_or(0, |(id, _)| id);
    let reason = if error == ScanError::LargeId {
        written_id(text, at) + &error.to_string()
    } else {
        error.to_string()
    };
    LostEntity {
        kind: LostKind::Entity,
        step_id,
        reason,
    }
}

/// A number that is too large to be kept as one, as it is written.
fn written_id(text: &[u8], at: usize) -> String {
    const MAX_DIGITS: usize = 40;
    let digits = text[at + 1..]
        .iter()
        .take_while(|byte| byte.is_ascii_digit());
    let digits: String = digits
        .take(MAX_DIGITS)
        .map(|&digit| char::from(digit))
        .collect();
    format!("#{digits}: ")
}
