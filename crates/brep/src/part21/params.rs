//! Parses the parameters of an instance one after the other, directly from the text.

use super::number::short_decimal;
use super::scan::{skip_binary, skip_blank, skip_list, skip_name, skip_string};

/// The reason why a parameter does not fit its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParamError {
    /// The text is not a parameter.
    #[error("a parameter does not parse")]
    Syntax,
    /// The list has ended.
    #[error("it has too few parameters")]
    Missing,
    /// The parameter is not of the named kind.
    #[error("a parameter is not {0}")]
    Kind(&'static str),
    /// The number is beyond the range of `f64`.
    #[error("a number is not finite")]
    NotFinite,
    /// The number of the instance is larger than 2⁶⁴ − 1.
    #[error("it refers to a number of more than 64 bits")]
    LargeId,
    /// The value is in another file (`@` or `<…>`, edition 3).
    #[error("a value is in another file")]
    Elsewhere,
}

/// A parameter. Strings and names are the raw bytes between their delimiters; [`decode_text`](super::decode_text) decodes a
/// string.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Param<'a> {
    /// `#12`.
    Reference(u64),
    /// An integer or a real.
    Number(f64),
    /// `'text'`, still encoded.
    Text(&'a [u8]),
    /// `.NAME.`.
    Enum(&'a [u8]),
    /// `(…)`.
    List(Params<'a>),
    /// `NAME(…)`.
    Typed(&'a [u8], Params<'a>),
    /// `"0A1"`.
    Binary,
    /// `$`, no value is given.
    Unset,
    /// `*`, the value follows from other values.
    Derived,
}

/// The rest of a parameter list. A copy is cheap, and reading the copy does not advance the original.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params<'a> {
    /// The text from the position after the opening parenthesis or a comma to the end of the file.
    rest: &'a [u8],
}

impl<'a> Params<'a> {
    /// The parameters that follow an opening parenthesis.
    pub(super) fn behind_parenthesis(rest: &'a [u8]) -> Self {
        Self { rest }
    }

    /// Takes the next parameter. Returns `None` at the closing parenthesis.
    ///
    /// # Errors
    /// If the text is not a parameter.
    pub fn next_param(&mut self) -> Result<Option<Param<'a>>, ParamError> {
        let text = self.rest;
        let at = skip_blank(text, 0);
        if text.get(at) == Some(&b')') {
            return Ok(None);
        }
        // The list continues after a number that is too large. So only the instance with this number is lost, and its neighbors
        // are not.
        let (param, end) = match parse(text, at) {
            Ok((param, end)) => (Ok(param), end),
            Err(ParamError::LargeId) => (Err(ParamError::LargeId), end_of_digits(text, at + 1)),
            Err(error) => return Err(error),
        };
        let end = skip_blank(text, end);
        match text.get(end) {
            Some(b',') => self.rest = &text[end + 1..],
            Some(b')') => self.rest = &text[end..],
            _ => return Err(ParamError::Syntax),
        }
        param.map(Some)
    }

    /// Takes the first `N` parameters.
    ///
    /// # Errors
    /// If there are fewer, or one of them does not parse.
    pub fn first<const N: usize>(mut self) -> Result<[Param<'a>; N], ParamError> {
        let mut params = [Param::Unset; N];
        let Some((last, others)) = params.split_last_mut() else {
            return Ok(params);
        };
        for param in others {
            *param = self.next_param()?.ok_or(ParamError::Missing)?;
        }
        *last = self.last()?.ok_or(ParamError::Missing)?;
        Ok(params)
    }

    /// Takes the last parameter that is needed. If it is a list, its end is not searched for.
    fn last(mut self) -> Result<Option<Param<'a>>, ParamError> {
        let at = skip_blank(self.rest, 0);
        match self.rest.get(at) {
            Some(b'(') => Ok(Some(Param::List(Self::behind_parenthesis(
                &self.rest[at + 1..],
            )))),
            _ => self.next_param(),
        }
    }

    /// The parameters one by one. Ends after the first one that does not parse, unless it is a reference with too many digits.
    pub fn iter(self) -> impl Iterator<Item = Result<Param<'a>, ParamError>> {
        let mut rest = Some(self);
        std::iter::from_fn(move || {
            let next = rest.as_mut()?.next_param();
            if next.is_err() && next != Err(ParamError::LargeId) {
                rest = None;
            }
            next.transpose()
        })
    }

    /// The parameters as references.
    ///
    /// # Errors
    /// If one of them is not a reference.
    pub fn references(self) -> Result<Vec<u64>, ParamError> {
        self.iter().map(|param| param?.reference()).collect()
    }

    /// The parameters as numbers.
    ///
    /// # Errors
    /// If one of them is not a number.
    pub fn numbers(self) -> Result<Vec<f64>, ParamError> {
        self.iter().map(|param| param?.number()).collect()
    }
}

impl<'a> Param<'a> {
    /// The number of the instance to which the parameter refers.
    ///
    /// # Errors
    /// If the parameter is not a reference.
    pub fn reference(self) -> Result<u64, ParamError> {
        match self {
            Self::Reference(id) => Ok(id),
            _ => Err(ParamError::Kind("a reference")),
        }
    }

    /// The parameter's number. It may be typed, as in `LENGTH_MEASURE(2.)`.
    ///
    /// # Errors
    /// If the parameter is neither a number nor a typed number, such as `LENGTH_MEASURE(2.)`.
    pub fn number(self) -> Result<f64, ParamError> {
        match self {
            Self::Number(number) => Ok(number),
            Self::Typed(..) => self.untyped()?.number(),
            _ => Err(ParamError::Kind("a number")),
        }
    }

    /// The value in a typed parameter such as `LABEL('x')`, or the parameter itself if it is not typed.
    fn untyped(self) -> Result<Self, ParamError> {
        // A select type inside a select type may name both types.
        const MAX_TYPES: usize = 4;
        let mut param = self;
        for _ in 0..MAX_TYPES {
            let Self::Typed(_, mut inner) = param else {
                return Ok(param);
            };
            param = inner.next_param()?.ok_or(ParamError::Missing)?;
        }
        Err(ParamError::Kind("a value of one type"))
    }

    /// The parameter's number as a count.
    ///
    /// # Errors
    /// If the parameter is not an integer from 0 to 2³² − 1.
    pub fn count(self) -> Result<usize, ParamError> {
        let number = self.number()?;
        // No count in a file needs more than 32 bits.
        if (0.0..=f64::from(u32::MAX)).contains(&number) && number.fract() == 0.0 {
            Ok(number as usize)
        } else {
            Err(ParamError::Kind("a count"))
        }
    }

    /// The parameter's list.
    ///
    /// # Errors
    /// If the parameter is not a list.
    pub fn list(self) -> Result<Params<'a>, ParamError> {
        match self {
            Self::List(params) => Ok(params),
            _ => Err(ParamError::Kind("a list")),
        }
    }

    /// The parameter's truth value.
    ///
    /// # Errors
    /// If the parameter is neither `.T.` nor `.F.`.
    pub fn flag(self) -> Result<bool, ParamError> {
        self.logical()?.ok_or(ParamError::Kind("a truth value"))
    }

    /// The parameter's truth value, in capital or small letters, short or written out. Returns `None` if it is unknown or
    /// omitted.
    ///
    /// # Errors
    /// If the parameter is not a truth value.
    pub fn logical(self) -> Result<Option<bool>, ParamError> {
        match self {
            Self::Enum(name) => logical_of(name),
            Self::Unset | Self::Derived => Ok(None),
            Self::Typed(..) => self.untyped()?.logical(),
            _ => Err(ParamError::Kind("a truth value")),
        }
    }

    /// The raw bytes of a string. Returns `None` for any other parameter.
    #[must_use]
    pub fn text(self) -> Option<&'a [u8]> {
        match self {
            Self::Text(text) => Some(text),
            Self::Typed(..) => self.untyped().ok()?.text(),
            _ => None,
        }
    }
}

fn logical_of(name: &[u8]) -> Result<Option<bool>, ParamError> {
    let is = |known: &[u8]| name.eq_ignore_ascii_case(known);
    match name {
        b"T" => Ok(Some(true)),
        b"F" => Ok(Some(false)),
        _ if is(b"T") || is(b"TRUE") => Ok(Some(true)),
        _ if is(b"F") || is(b"FALSE") => Ok(Some(false)),
        _ if is(b"U") || is(b"UNKNOWN") => Ok(None),
        _ => Err(ParamError::Kind("a truth value")),
    }
}

/// Parses the parameter that starts at `at`, and returns it with the position after it.
fn parse(text: &[u8], at: usize) -> Result<(Param<'_>, usize), ParamError> {
    let byte = *text.get(at).ok_or(ParamError::Syntax)?;
    match byte {
        b'#' => parse_reference(text, at),
        b'0'..=b'9' | b'-' | b'+' => parse_number(text, at),
        b'.' if text.get(at + 1).is_some_and(u8::is_ascii_digit) => parse_number(text, at),
        b'.' => parse_enum(text, at),
        b'(' => parse_list(text, at).map(|(params, end)| (Param::List(params), end)),
        b'\'' => {
            let end = skip_string(text, at).map_err(|_| ParamError::Syntax)?;
            Ok((Param::Text(&text[at + 1..end - 1]), end))
        }
        b'"' => skip_binary(text, at)
            .map(|end| (Param::Binary, end))
            .map_err(|_| ParamError::Syntax),
        b'$' => Ok((Param::Unset, at + 1)),
        b'*' => Ok((Param::Derived, at + 1)),
        // There is nothing between two commas.
        b',' => Ok((Param::Unset, at)),
        b'@' => Err(ParamError::Elsewhere),
        b'A'..=b'Z' | b'a'..=b'z' | b'!' => {
            let end = skip_name(text, at);
            let (params, list_end) = parse_list(text, skip_blank(text, end))?;
            Ok((Param::Typed(&text[at..end], params), list_end))
        }
        _ => Err(ParamError::Syntax),
    }
}

fn parse_list(text: &[u8], at: usize) -> Result<(Params<'_>, usize), ParamError> {
    if text.get(at) != Some(&b'(') {
        return Err(ParamError::Syntax);
    }
    let end = skip_list(text, at).map_err(|_| ParamError::Syntax)?;
    Ok((Params::behind_parenthesis(&text[at + 1..]), end))
}

fn parse_reference(text: &[u8], at: usize) -> Result<(Param<'_>, usize), ParamError> {
    let has_digits = text.get(at + 1).is_some_and(u8::is_ascii_digit);
    let problem = if has_digits {
        ParamError::LargeId
    } else {
        ParamError::Syntax
    };
    let (id, end) = parse_id(text, at + 1).ok_or(problem)?;
    Ok((Param::Reference(id), end))
}

fn end_of_digits(text: &[u8], at: usize) -> usize {
    at + text[at..]
        .iter()
        .take_while(|byte| byte.is_ascii_digit())
        .count()
}

/// Parses the digits of an instance number. Returns `None` if there is no digit, or if there are too many.
pub(super) fn parse_id(text: &[u8], at: usize) -> Option<(u64, usize)> {
    let mut id = 0_u64;
    let mut end = at;
    while let Some(digit @ b'0'..=b'9') = text.get(end) {
        id = id.checked_mul(10)?.checked_add(u64::from(digit - b'0'))?;
        end += 1;
    }
    (end > at).then_some((id, end))
}

fn parse_enum(text: &[u8], at: usize) -> Result<(Param<'_>, usize), ParamError> {
    let end = skip_name(text, at + 1);
    let name = &text[at + 1..end];
    // Some writers forget the closing dot.
    Ok((
        Param::Enum(name),
        end + usize::from(text.get(end) == Some(&b'.')),
    ))
}

fn parse_number(text: &[u8], at: usize) -> Result<(Param<'_>, usize), ParamError> {
    if let Some((number, end)) = short_decimal(text, at) {
        return Ok((Param::Number(number), end));
    }
    let is_in_number = |byte: &u8| {
        matches!(
            byte,
            b'0'..=b'9' | b'+' | b'-' | b'.' | b'e' | b'E' | b'd' | b'D'
        )
    };
    let n_bytes = text[at..]
        .iter()
        .take_while(|byte| is_in_number(byte))
        .count();
    let digits = std::str::from_utf8(&text[at..at + n_bytes]).map_err(|_| ParamError::Syntax)?;
    let number: f64 = match digits.parse() {
        Ok(number) => number,
        // FORTRAN programs write exponents with a D.
        Err(_) => digits
            .replace(['d', 'D'], "E")
            .parse()
            .map_err(|_| ParamError::Syntax)?,
    };
    if number.is_finite() {
        Ok((Param::Number(number), at + n_bytes))
    } else {
        Err(ParamError::NotFinite)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn params(text: &str) -> Params<'_> {
        Params::behind_parenthesis(text.as_bytes())
    }

    #[track_caller]
    fn check(text: &str, expected: Result<Param<'_>, ParamError>) {
        assert_eq!(params(text).first::<1>().map(|[param]| param), expected);
    }

    #[track_caller]
    fn check_number(text: &str, expected: f64) {
        check(&format!("{text})"), Ok(Param::Number(expected)));
    }

    #[test]
    fn every_kind_of_parameter() {
        check("#18446744073709551615)", Ok(Param::Reference(u64::MAX)));
        check(" $ )", Ok(Param::Unset));
        check("*,1)", Ok(Param::Derived));
        check("'it''s')", Ok(Param::Text(b"it''s")));
        check(".UNSPECIFIED.)", Ok(Param::Enum(b"UNSPECIFIED")));
        check(".T)", Ok(Param::Enum(b"T")));
        check("\"0FF\")", Ok(Param::Binary));
        check("/* c */ #7 /* d */)", Ok(Param::Reference(7)));
    }

    #[test]
    fn truth_values_in_all_their_spellings() {
        let logical = |text: &str| params(&format!("{text})")).first::<1>().unwrap()[0].logical();
        for (text, expected) in [
            (".T.", Ok(Some(true))),
            (".true.", Ok(Some(true))),
            (".True.", Ok(Some(true))),
            (".t.", Ok(Some(true))),
            ("BOOLEAN(.TRUE.)", Ok(Some(true))),
            (".F.", Ok(Some(false))),
            (".fAlSe.", Ok(Some(false))),
            (".f", Ok(Some(false))),
            (".U.", Ok(None)),
            (".unknown.", Ok(None)),
            ("$", Ok(None)),
            ("*", Ok(None)),
            (".YES.", Err(ParamError::Kind("a truth value"))),
            ("1", Err(ParamError::Kind("a truth value"))),
        ] {
            assert_eq!(logical(text), expected, "{text}");
        }
    }

    #[test]
    fn omitted_parameters_are_unset() {
        assert_eq!(
            params(",2)").first(),
            Ok([Param::Unset, Param::Number(2.0)])
        );
        assert_eq!(
            params("1,,2)").first(),
            Ok([Param::Number(1.0), Param::Unset, Param::Number(2.0)])
        );
        assert_eq!(params("1,,2)").numbers(), Err(ParamError::Kind("a number")));
    }

    #[test]
    fn numbers_in_all_their_spellings() {
        check_number("1.E-05", 1e-5);
        check_number("1.0D+3", 1000.0);
        check_number("-.5", -0.5);
        check_number("+5", 5.0);
        check_number("0", 0.0);
        check_number("1.e2", 100.0);
        check_number("3.", 3.0);
        check_number("+.5E+01", 5.0);
        check_number("1D3", 1000.0);
        check_number("-1.5d-1", -0.15);
    }

    #[test]
    fn texts_that_are_not_a_parameter() {
        check("#99999999999999999999)", Err(ParamError::LargeId));
        check("@5)", Err(ParamError::Elsewhere));
        check("#)", Err(ParamError::Syntax));
        check("1.#INF)", Err(ParamError::Syntax));
        check("NAN)", Err(ParamError::Syntax));
        check("1E999)", Err(ParamError::NotFinite));
        check("--1)", Err(ParamError::Syntax));
        check("1 2)", Err(ParamError::Syntax));
        check(")", Err(ParamError::Missing));
        check("", Err(ParamError::Syntax));
        assert_eq!(params("(1").next_param(), Err(ParamError::Syntax));
        check_number("1.797693134862315700E+308", f64::MAX);
        check("1.E)", Err(ParamError::Syntax));
        check("1.2.3)", Err(ParamError::Syntax));
        check("1E2E3)", Err(ParamError::Syntax));
        check("-)", Err(ParamError::Syntax));
    }

    #[test]
    fn lists_and_typed_values_open() {
        let [points, measure] = params("(#1,#2),LENGTH_MEASURE(2.5))").first().unwrap();
        assert_eq!(points.list().unwrap().references(), Ok(vec![1, 2]));
        assert_eq!(measure.number(), Ok(2.5));
        let [large, measure] = params("(#1,#99999999999999999999,#2),LENGTH_MEASURE(2.5))")
            .first()
            .unwrap();
        let ids: Vec<_> = large
            .list()
            .unwrap()
            .iter()
            .map(|id| id?.reference())
            .collect();
        assert_eq!(ids, [Ok(1), Err(ParamError::LargeId), Ok(2)]);
        assert_eq!(measure.number(), Ok(2.5));
        let [label, nested] = params("LABEL('x'),A(B(2.)))").first().unwrap();
        assert_eq!((label.text(), nested.number()), (Some(&b"x"[..]), Ok(2.0)));
        assert_eq!(Param::Number(1e9).count(), Ok(1_000_000_000));
        assert_eq!(Param::Number(1.5).count(), Err(ParamError::Kind("a count")));
        assert_eq!(
            Param::Number(-1.0).count(),
            Err(ParamError::Kind("a count"))
        );
    }

    proptest! {
        #[test]
        fn numbers_are_rounded_as_the_standard_library_does(
            text in "[-+]?[0-9]{0,20}\\.[0-9]{0,20}([eE][-+]?[0-9]{1,3})?",
        ) {
            let expected = text.parse::<f64>().ok().filter(|number| number.is_finite());
            let found = params(&format!("{text})")).first::<1>().and_then(|[param]| param.number());
            prop_assert_eq!(found.ok().map(f64::to_bits), expected.map(f64::to_bits), "{}", text);
        }

        #[test]
        fn any_bytes_end_in_an_answer(text: Vec<u8>) {
            let mut params = Params::behind_parenthesis(&text);
            while let Ok(Some(_)) = params.next_param() {}
        }
    }
}
