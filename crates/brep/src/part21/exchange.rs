//! Indexes the instances of a file: the position of each in the text, and its class.

use super::keyword::{Keyword, is_class};
use super::params::Params;
use super::record::{ExchangeError, Record};
use super::records::{Records, scan_records};
use super::scan::{skip_blank, skip_list, skip_name, skip_resource};
use crate::model::{LostEntity, LostKind};

/// The signature must be within this number of bytes. A byte order mark or a comment may come before it.
const SIGNATURE_WINDOW: usize = 4096;

/// A Part 21 text with an index of its instances.
pub struct Exchange<'a> {
    text: &'a [u8],
    /// Sorted by id, each id once.
    records: Vec<Record>,
    /// The index of each id's record plus one. The table is empty if the ids are not dense enough.
    slots: Vec<u32>,
    /// The instances that are in other files, sorted by id, with the positions where the text names these files.
    elsewhere: Vec<(u64, u32)>,
    /// The classes of all complex instances, by the position of their instance.
    partials: Vec<Partial>,
}

/// One class of a complex instance. All numbers are positions in the text.
#[derive(Clone, Copy, Debug)]
struct Partial {
    /// The beginning of its instance.
    instance: u32,
    name: u32,
    name_end: u32,
    /// The first byte of its parameters.
    params: u32,
}

impl<'a> Exchange<'a> {
    /// Indexes every instance of a text that [`normalized`](super::normalized) returned. Instances that do not parse are
    /// added to `lost`.
    ///
    /// The text must be shorter than 4 GiB. Cost: one pass over the text.
    ///
    /// # Errors
    /// If the text is not an exchange structure, has no instance, or has more than `max_entities` instances.
    pub fn index(
        text: &'a [u8],
        max_entities: u64,
        lost: &mut Vec<LostEntity>,
    ) -> Result<Self, ExchangeError> {
        let window = &text[..text.len().min(SIGNATURE_WINDOW)];
        if !window
            .windows(12)
            .any(|bytes| bytes.eq_ignore_ascii_case(b"ISO-10303-21"))
        {
            return Err(ExchangeError::NotStep);
        }
        let Records {
            instances: mut records,
            mut elsewhere,
        } = scan_records(text, max_entities, lost)?;
        if records.is_empty() {
            return Err(ExchangeError::NoData);
        }
        if !records.is_sorted_by(|a, b| a.id < b.id) {
            drop_repeated_ids(&mut records, lost);
        }
        let slots = dense_slots(&records);
        elsewhere.sort_by_key(|&(id, _)| id);
        elsewhere.dedup_by_key(|&mut (id, _)| id);
        let partials = partials_of_complex(text, &records);
        Ok(Self {
            text,
            records,
            slots,
            elsewhere,
            partials,
        })
    }

    /// Every instance, by ascending number.
    #[must_use]
    pub fn records(&self) -> &[Record] {
        &self.records
    }

    /// The index of an instance in [`Exchange::records`].
    pub(crate) fn slot(&self, id: u64) -> Option<usize> {
        if self.slots.is_empty() {
            return self
                .records
                .binary_search_by_key(&id, |record| record.id)
                .ok();
        }
        let slot = *self.slots.get(usize::try_from(id).ok()?)?;
        (slot as usize).checked_sub(1)
    }

    /// The instance with this number. Returns `None` if the file does not contain it.
    #[must_use]
    pub fn record(&self, id: u64) -> Option<Record> {
        self.slot(id).map(|slot| self.records[slot])
    }

    /// The address (`file.stp#anchor`) of an instance that the `REFERENCE` section assigns to another file. Returns `None` if it
    /// does not.
    #[must_use]
    pub fn address(&self, id: u64) -> Option<String> {
        let entry = self
            .elsewhere
            .binary_search_by_key(&id, |&(id, _)| id)
            .ok()?;
        let start = self.elsewhere[entry].1 as usize;
        let end = skip_resource(self.text, start);
        let address = self.text[start + 1..end]
            .strip_suffix(b">")
            .unwrap_or_default();
        Some(String::from_utf8_lossy(address).into_owned())
    }

    /// The parameters of a plain instance. Use [`Exchange::partial`] for a complex one.
    #[must_use]
    pub fn params(&self, record: Record) -> Params<'a> {
        let at = skip_name(self.text, record.at as usize + usize::from(record.n_name));
        // The scan has seen the parenthesis that is skipped here.
        Params::behind_parenthesis(
            self.text
                .get(skip_blank(self.text, at) + 1..)
                .unwrap_or_default(),
        )
    }

    /// The text of an instance, from its class to the closing parenthesis.
    #[must_use]
    pub fn written(&self, record: Record) -> &'a [u8] {
        let start = record.at as usize;
        let list = skip_blank(self.text, skip_name(self.text, start));
        // The scan has seen the end of the list.
        let end = skip_list(self.text, list).unwrap_or(self.text.len());
        &self.text[start..end]
    }

    /// The classes of an instance with their parameters: one for a plain instance, several for a complex one.
    pub fn partials(
        &self,
        record: Record,
    ) -> impl Iterator<Item = (&'a [u8], Params<'a>)> + use<'_, 'a> {
        let is_known = record.keyword == Keyword::Complex;
        let first = self
            .partials
            .partition_point(|partial| is_known && partial.instance < record.at);
        let known = self.partials[first..]
            .iter()
            .take_while(move |partial| is_known && partial.instance == record.at)
            .copied();
        let walked = (!is_known)
            .then(|| partials_of(self.text, record))
            .into_iter()
            .flatten();
        let text = self.text;
        known.chain(walked).map(move |partial| {
            let name = &text[partial.name as usize..partial.name_end as usize];
            (
                name,
                Params::behind_parenthesis(&text[partial.params as usize..]),
            )
        })
    }

    /// The parameters of one class of an instance. Returns `None` if the instance is not of this class.
    #[must_use]
    pub fn partial(&self, record: Record, name: &str) -> Option<Params<'a>> {
        self.partials(record)
            .find(|(class, _)| is_class(class, name))
            .map(|(_, params)| params)
    }

    /// The name of an instance's class as it is written. A complex instance gives up to eight names, joined by plus signs.
    #[must_use]
    pub fn class_name(&self, record: Record) -> String {
        let names: Vec<_> = self
            .partials(record)
            .take(8)
            .map(|(name, _)| String::from_utf8_lossy(name))
            .collect();
        names.join("+")
    }
}

/// The classes of all complex instances. They are found once, because each question about a complex instance concerns all of
/// its classes.
fn partials_of_complex(text: &[u8], records: &[Record]) -> Vec<Partial> {
    let complex = records
        .iter()
        .filter(|record| record.keyword == Keyword::Complex);
    let mut partials: Vec<Partial> = complex
        .flat_map(|&record| partials_of(text, record))
        .collect();
    partials.sort_by_key(|partial| partial.instance);
    partials
}

/// The classes of an instance.
fn partials_of(text: &[u8], record: Record) -> impl Iterator<Item = Partial> + use<'_> {
    let is_complex = text.get(record.at as usize) == Some(&b'(');
    let mut at = Some(record.at as usize + usize::from(is_complex));
    std::iter::from_fn(move || {
        let partial = partial_at(text, record.at, at?)?;
        at = if is_complex {
            skip_list(text, partial.params as usize - 1).ok()
        } else {
            None
        };
        Some(partial)
    })
}

/// The class whose name and list begin at a position in an instance. Returns `None` if there is something else.
fn partial_at(text: &[u8], instance: u32, at: usize) -> Option<Partial> {
    let name = skip_blank(text, at);
    let name_end = skip_name(text, name);
    let list = skip_blank(text, name_end);
    let is_partial = name_end > name && text.get(list) == Some(&b'(');
    is_partial.then_some(Partial {
        instance,
        name: name as u32,
        name_end: name_end as u32,
        params: list as u32 + 1,
    })
}

/// Sorts by id, and keeps only the first of several records with the same id.
fn drop_repeated_ids(records: &mut Vec<Record>, lost: &mut Vec<LostEntity>) {
    records.sort_by_key(|record| record.id);
    records.dedup_by(|later, first| {
        let is_repeated = later.id == first.id;
        if is_repeated {
            let reason = "another instance has the same number".to_owned();
            lost.push(LostEntity {
                kind: LostKind::Entity,
                step_id: later.id,
                reason,
            });
        }
        is_repeated
    });
}

/// A table from id to record, unless the ids lie so far apart that it would be large.
fn dense_slots(records: &[Record]) -> Vec<u32> {
    let max_id = records.last().map_or(0, |record| record.id);
    if max_id > 8 * records.len() as u64 + 1024 {
        return Vec::new();
    }
    let mut slots = vec![0; max_id as usize + 1];
    for (slot, record) in (1..).zip(records) {
        slots[record.id as usize] = slot;
    }
    slots
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Indexed = Result<Vec<(u64, Keyword)>, ExchangeError>;

    fn index(data: &str) -> (Indexed, Vec<u64>) {
        let text = format!(
            "ISO-10303-21;\nHEADER;\nFILE_NAME('a;#1=B()',$);\nENDSEC;\nDATA;\n{data}\nENDSEC;\nEND-ISO-10303-21;"
        );
        let mut lost = Vec::new();
        let records = Exchange::index(text.as_bytes(), 1000, &mut lost).map(|exchange| {
            exchange
                .records()
                .iter()
                .map(|record| (record.id, record.keyword))
                .collect()
        });
        (records, lost.iter().map(|loss| loss.step_id).collect())
    }

    #[track_caller]
    fn check(data: &str, expected: &[(u64, Keyword)], expected_lost: &[u64]) {
        assert_eq!(index(data), (Ok(expected.to_vec()), expected_lost.to_vec()));
    }

    #[test]
    fn instances_are_found_and_damaged_ones_named() {
        use Keyword::{Complex, Line, Other, Plane};
        check(
            "#1=PLANE('',#2);\n#2=FOO();",
            &[(1, Plane), (2, Other)],
            &[],
        );
        check(
            "#7 = ( A() B(1) ) ;#1=/* x */line('');",
            &[(1, Line), (7, Complex)],
            &[],
        );
        check("#1=PLANE('',#2)\n#2=LINE();", &[(1, Plane), (2, Line)], &[]);
        check("#1=PLANE('',#2;\n#2=LINE();", &[(2, Line)], &[1]);
        check(
            "#1=PLANE('abc,#3);\n#2=LINE('x');\n#3=LINE('y');",
            &[(2, Line), (3, Line)],
            &[1],
        );
        check(
            "#1=;\n#x=PLANE();\n#2 PLANE();\n#3=PLANE();",
            &[(3, Plane)],
            &[1, 0, 2],
        );
        check("#1=PLANE();\n#1=LINE();", &[(1, Plane)], &[1]);
        check(
            "#1=PLANE();ENDSEC;DATA('b',('c'));#2=LINE();",
            &[(1, Plane), (2, Line)],
            &[],
        );
        check("#18446744073709551615=PLANE();", &[(u64::MAX, Plane)], &[]);
        check("#1=PLANE();\n#2=LINE(", &[(1, Plane)], &[2]);
    }

    #[test]
    fn text_after_the_end_is_not_read() {
        #[track_caller]
        fn check(text: &str, expected: &[u64], expected_lost: &[u64]) {
            let mut lost = Vec::new();
            let exchange = Exchange::index(text.as_bytes(), 1000, &mut lost).unwrap();
            let ids: Vec<u64> = exchange.records().iter().map(|record| record.id).collect();
            let lost: Vec<u64> = lost.iter().map(|loss| loss.step_id).collect();
            assert_eq!(
                (ids, lost),
                (expected.to_vec(), expected_lost.to_vec()),
                "{text}"
            );
        }
        let one = |data: &str| {
            format!("ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n{data}\nENDSEC;\nEND-ISO-10303-21;\n")
        };
        check(&one("#1=A();"), &[1], &[]);
        // Text that is not an instance may follow, for example a signature, the end of a mail, or quotes without an end.
        check(
            &(one("#1=A();") + "SIGNATURE;\nMIIE/*'x\nENDSEC;\nIt's #2."),
            &[1],
            &[],
        );
        check(&(one("#1=A();") + "it's\n# 5 pieces\n"), &[1], &[]);
        check(&(one("#1=A();") + "#2=B();\n#3=C();"), &[1], &[2]);
        check(&(one("#1=A();") + "'\n#2=B();\n#3=C();"), &[1], &[2]);
        check(
            &one("#1=A();")
                .replace("END-ISO", "end-iso")
                .replace("21;\n", "21 ;\n"),
            &[1],
            &[],
        );
        // A second structure is read even if other text is before it.
        check(
            &(one("#1=A();") + "don't\n" + &one("#2=B();")),
            &[1, 2],
            &[],
        );
        check(
            &(one("#1=A();") + "#7=X();\n" + &one("#2=B();") + "#8=Y();"),
            &[1, 2],
            &[7, 8],
        );
        check(&(one("#1=A();") + "see ISO-10303-21;\n#7=X();"), &[1], &[7]);
        // In strings and comments, the marker has no meaning.
        check(
            &one("#1=A('END-ISO-10303-21;');\n#2=B('\nEND-ISO-10303-21;\n');\n#3=C();"),
            &[1, 2, 3],
            &[],
        );
        check(
            &one("/* END-ISO-10303-21; */\n#1=A(/*\nEND-ISO-10303-21;\n*/);\n#2=B();"),
            &[1, 2],
            &[],
        );
        // A damaged instance does not hide it.
        check(&(one("#1=A();\n#2=B('") + "#3=C();\n"), &[1], &[2, 3]);
        check(
            &(one("#1=A();\n#2=B((1);") + &one("#3=C();")),
            &[1, 3],
            &[2],
        );
        check(
            "ISO-10303-21;DATA;#1=A();ENDSEC;END-ISO-10303-21;#2=B();",
            &[1],
            &[2],
        );
    }

    #[test]
    fn partials_come_in_any_order() {
        let text = b"ISO-10303-21;DATA;#1=(B(2)A(1)C());#2=PLANE('p');";
        let exchange = Exchange::index(text, 10, &mut Vec::new()).unwrap();
        let record = exchange.record(1).unwrap();
        let first = |name| {
            exchange
                .partial(record, name)
                .map(|params| params.numbers())
        };
        assert_eq!(
            (first("A"), first("b"), first("C"), first("D")),
            (
                Some(Ok(vec![1.0])),
                Some(Ok(vec![2.0])),
                Some(Ok(vec![])),
                None
            )
        );
        assert_eq!(exchange.class_name(record), "B+A+C");
        assert_eq!(exchange.class_name(exchange.record(2).unwrap()), "PLANE");
    }

    #[test]
    fn texts_that_are_not_an_exchange_structure() {
        let error = |text: &[u8]| Exchange::index(text, 2, &mut Vec::new()).err();
        assert_eq!(error(b"solid cube"), Some(ExchangeError::NotStep));
        assert_eq!(
            error(b"ISO-10303-21;HEADER;ENDSEC;"),
            Some(ExchangeError::NoData)
        );
        assert_eq!(
            error(b"ISO-10303-21;DATA;#1=A();#2=A();#3=A();"),
            Some(ExchangeError::TooManyEntities)
        );
    }

    #[test]
    fn unclosed_strings_do_not_make_the_pass_quadratic() {
        let data: String = (1..20_000).map(|id| format!("#{id}=A('',\n")).collect();
        let text = format!("ISO-10303-21;DATA;{data}");
        let mut lost = Vec::new();
        assert!(Exchange::index(text.as_bytes(), 100_000, &mut lost).is_err());
        assert!(!lost.is_empty());
    }

    proptest! {
        #[test]
        fn any_bytes_end_in_an_answer(data in "[#=();',A-C0-9 \n/*]{0,80}") {
            let _ = index(&data);
        }
    }
}
