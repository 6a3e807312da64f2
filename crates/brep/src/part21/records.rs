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

/// The beginning and the end of an exchange structure, and the text that both have in common.
const BEGIN: &[u8] = b"ISO-10303-21";
const END: &[u8] = b"END-ISO-10303-21";
const MARK: &[u8] = b"-10303-21";

/// The contents of the sections of a text.
pub(super) struct Records {
    /// The instances in file order.
    pub(super) instances: Vec<Record>,
    /// The number of each instance that is in another file, and the position at which the text names that file.
    pub(super) elsewhere: Vec<(u64, u32)>,
}

/// A statement that begins with `#` and a number.
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

/// A statement with the position after it, or the reason why it breaks off and the position.
type ScanResult = Result<(Statement, usize), (ScanError, usize)>;

/// One pass over a text.
struct Pass<'t, 'l> {
    text: &'t [u8],
    records: Records,
    lost: &'l mut Vec<LostEntity>,
    /// The instances whose scopes are open, each with the position where it begins.
    open_scopes: Vec<(u64, usize)>,
    /// The number of bytes that were read again after damaged instances. It is limited to the length of the text, so the pass
    /// remains linear.
    n_reread: usize,
}

impl<'t, 'l> Pass<'t, 'l> {
    fn over(text: &'t [u8], lost: &'l mut Vec<LostEntity>) -> Self {
        Self {
            text,
            records: Records {
                // Real files have about 60 bytes per instance.
                instances: Vec::with_capacity(text.len() / 48),
                elsewhere: Vec::new(),
            },
            lost,
            open_scopes: Vec::new(),
            n_reread: 0,
        }
    }

    /// Reads the end of a scope. It also ends the statement of the instance that opened the scope.
    fn end_of_scope(&mut self, at: usize) -> usize {
        let scope = self.open_scopes.pop();
        let named_at = scope.map_or(at, |(_, begin)| begin);
        self.take(at, named_at, scan_end_of_scope(self.text, at, scope))
    }

    /// Keeps the contents of a statement, and returns the position at which reading continues. The number of the instance is at
    /// `named_at`.
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

    /// The position at which reading continues after a damaged instance. The instance begins at `begin` and breaks off at `stop`.
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

    /// Returns the contents. Scopes that are still open are lost entities.
    fn finish(self) -> Records {
        let open = self.open_scopes.into_iter();
        self.lost
            .extend(open.map(|(_, begin)| loss(self.text, begin, ScanError::OpenScope)));
        self.records
    }
}

/// Scans a statement that begins with `#`. Returns the position after it, or the position at which it breaks off.
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
    // A missing semicolon is accepted, because the next instance shows where this one ends.
    Ok((
        Statement::Instance(record),
        end + usize::from(text.get(end) == Some(&b';')),
    ))
}

/// If one class is a context, the instance is a context, even if it has other classes. Files have thousands of them, and later
/// steps need not search them.
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

/// Skips the text between two exchange structures, or after the last one. Instances in it are named as lost, because no writer
/// puts them there on purpose.
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

/// The next position at which a line or a statement begins with this name, followed only by a semicolon.
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

/// Scans `ENDSCOPE /#1,#2/ CLASS(…);`, the instance whose scope ends. The instances that it exports are already known.
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

/// The next position at which a `#` begins a line or a statement, or follows only blanks.
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

/// Skips a statement that is not an instance, such as the name of a section, an entity of the header or an anchor.
fn skip_statement(text: &[u8], mut at: usize) -> usize {
    while let Some(&byte) = text.get(at) {
        match byte {
            b';' => return at + 1,
            b'\'' => {
                let end = skip_string(text, at).unwrap_or(text.len());
                // A superfluous apostrophe is detected here. Otherwise it would hide the sections that follow.
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

/// The text of a number that is too large for an integer.
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
