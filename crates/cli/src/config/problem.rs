//! Describes a problem of a config, with its place: the file and the line, or the argument.
//!
//! The settings are read after merging, so an error has only the key. This module searches the key in the texts of the caller.

use super::flag::as_written;
use std::fmt;
use toml::Table;
use toml::de::{DeArray, DeTable, DeValue};

/// Names are similar if at least this fraction of their letters agrees.
const MIN_SIMILARITY: f64 = 0.7;

/// A key with a value that cannot be used, or a key that does not exist.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ConfigProblem {
    /// The key with its tables, such as `train.steps`. It is empty if the problem belongs to no key.
    pub(super) key: String,
    message: String,
}

impl std::error::Error for ConfigProblem {}

impl fmt::Display for ConfigProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl ConfigProblem {
    /// A problem that was found while reading the table with this path. `defaults` has every existing key.
    pub(super) fn of_reading(path: &str, message: &str, defaults: &Table) -> Self {
        let message = &without_internal_keys(message);
        let name = quoted(message).next().unwrap_or_default().to_owned();
        let is_unknown_key = message.starts_with("unknown field");
        let path = if path == "." { "" } else { path };
        // The path of a key that does not exist may end in that key.
        let (table, last) = path.rsplit_once('.').unwrap_or(("", path));
        let path = if is_unknown_key && last == name {
            table
        } else {
            path
        };
        let joined = |name: &str| {
            if path.is_empty() {
                name.to_owned()
            } else {
                format!("{path}.{name}")
            }
        };
        let key = if is_unknown_key {
            joined(&name)
        } else {
            path.to_owned()
        };
        let allowed: Vec<&str> = quoted(message).skip(1).collect();
        let is_choice = is_unknown_key || message.starts_with("unknown variant");
        let near = nearest(&name, &allowed).map(|near| {
            if is_unknown_key {
                joined(near)
            } else {
                near.to_owned()
            }
        });
        let elsewhere = || {
            if is_unknown_key {
                // A key of another type of the same table has the same path, so it is not a useful hint.
                key_named(&name, defaults).filter(|near| *near != key)
            } else {
                None
            }
        };
        let near = if is_choice {
            near.or_else(elsewhere)
        } else {
            None
        };
        let advice = match near {
            Some(near) => format!("; did you mean `{near}`?"),
            None if message.starts_with("missing field") && has_type(path, defaults) => {
                "; the keys of such a table have no defaults, so write each of them".to_owned()
            }
            None if message.starts_with("missing field") => {
                "; `base = \"base\"` at the top of the file gives every key its default".to_owned()
            }
            None => String::new(),
        };
        let plain = plain_words(message.trim_end());
        let message = if key.is_empty() {
            format!("{plain}{advice}")
        } else {
            format!("{key}: {plain}{advice}")
        };
        Self { key, message }
    }

    /// A problem of a key that the message alone does not show, because it contains spaces.
    pub(super) fn of_key(key: String, message: String) -> Self {
        Self { key, message }
    }

    /// A problem that a check has found. Its message names the key.
    pub(super) fn of_check(message: String) -> Self {
        let is_key = |word: &&str| {
            let is_of_key = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
            word.contains('.')
                && word.starts_with(|c: char| c.is_ascii_lowercase())
                && word.chars().all(is_of_key)
        };
        let words = message
            .split_whitespace()
            .map(|word| word.trim_matches(|c| ",:;".contains(c)));
        let table = message
            .split_once(':')
            .map(|(table, _)| table)
            .filter(|table| !table.contains(' '));
        let key = words
            .take(8)
            .find(is_key)
            .or(table)
            .unwrap_or_default()
            .to_owned();
        Self { key, message }
    }
}

/// Keys that can be read, but that no message suggests. Runs and checkpoints of earlier versions have `sabotage`. Now, a training
/// with a fault is started by `--inject-fault`.
const INTERNAL_KEYS: [&str; 1] = ["sabotage"];

/// The message without the internal keys in its list of expected keys.
fn without_internal_keys(message: &str) -> String {
    let Some((unknown, expected)) = message.split_once(", expected ") else {
        return message.to_owned();
    };
    let expected = INTERNAL_KEYS
        .iter()
        .fold(expected.to_owned(), |expected, key| {
            expected
                .replace(&format!(", `{key}`"), "")
                .replace(&format!("`{key}`, "), "")
        });
    format!("{unknown}, expected {expected}")
}

/// Whether a path leads to a table whose keys depend on its `type`: the default has another type, or there is no default.
fn has_type(path: &str, defaults: &Table) -> bool {
    let mut table = defaults;
    for part in path.split('.').filter(|part| !part.is_empty()) {
        match table.get(part).and_then(toml::Value::as_table) {
            Some(below) => table = below,
            None => return true,
        }
    }
    table.contains_key("type")
}

/// The words between backticks.
fn quoted(message: &str) -> impl Iterator<Item = &str> {
    message.split('`').skip(1).step_by(2)
}

/// The message with simple words instead of Rust's names of types.
fn plain_words(message: &str) -> String {
    let Some((before, expected)) = message.rsplit_once("expected ") else {
        return message.to_owned();
    };
    let plain = match expected {
        "usize" | "u64" | "u32" | "u16" | "u8" => "a whole number from 0 up",
        "i64" | "i32" => "a whole number",
        "f64" | "f32" => "a number",
        "a sequence" => "a list in [ ]",
        "a boolean" => "true or false",
        other if other.starts_with("struct ") => "a table of keys, for example label.theta_deg=12",
        other if other.starts_with("internally tagged enum ") => "a table with the key `type`",
        other => other,
    };
    format!("{before}expected {plain}")
}

/// The most similar name, if one is similar enough, and otherwise a name that begins with the given one.
pub(crate) fn nearest<'a>(name: &str, names: &[&'a str]) -> Option<&'a str> {
    alike(name, names).or_else(|| longer(name, names))
}

/// The name that may have been meant, as the end of a message. The known names are separated by commas. It is empty if none is
/// similar.
pub(crate) fn suggestion(name: &str, known: &str) -> String {
    let known: Vec<&str> = known.split(", ").collect();
    nearest(name, &known).map_or_else(String::new, |near| format!("; did you mean `{near}`?"))
}

/// The first name in the alphabet that begins with another and `_`, such as `theta_deg` for `theta`.
fn longer<'a>(name: &str, names: &[&'a str]) -> Option<&'a str> {
    let begins = |other: &&str| {
        other
            .strip_prefix(name)
            .is_some_and(|rest| rest.starts_with('_'))
    };
    names
        .iter()
        .copied()
        .filter(|other| !name.is_empty() && begins(other))
        .min()
}

fn alike<'a>(name: &str, names: &[&'a str]) -> Option<&'a str> {
    let rated = names
        .iter()
        .map(|&other| (strsim::normalized_damerau_levenshtein(name, other), other));
    let best =
        rated.max_by(|(a, first), (b, second)| a.total_cmp(b).then_with(|| second.cmp(first)));
    best.filter(|&(similarity, _)| similarity >= MIN_SIMILARITY)
        .map(|(_, other)| other)
}

/// The key of another table that has this name.
fn key_named(name: &str, defaults: &Table) -> Option<String> {
    let mut open: Vec<(String, &Table)> = vec![(String::new(), defaults)];
    while let Some((path, table)) = open.pop() {
        for (key, value) in table {
            let path = if path.is_empty() {
                key.clone()
            } else {
                format!("{path}.{key}")
            };
            if key == name {
                return Some(path);
            }
            open.extend(value.as_table().map(|table| (path, table)));
        }
    }
    None
}

/// A text from the caller, with its name in messages.
pub(super) struct Layer<'a> {
    pub(super) name: String,
    pub(super) text: &'a str,
}

/// The place of a key: an argument, or a line of a file. Later settings replace earlier ones, so they are searched first.
pub(super) fn position_of(
    problem: &ConfigProblem,
    overrides: &[String],
    layers: &[Layer<'_>],
) -> Option<String> {
    let key = problem.key.as_str();
    if key.is_empty() {
        return None;
    }
    let latest = |assigns: &dyn Fn(&str) -> bool| {
        let mut latest_first = overrides.iter().rev();
        latest_first
            .find(|assignment| assigns(&assigned_key(assignment)))
            .map(|assignment| as_written(assignment))
    };
    let is_quoted = |rest: &str| quoted(&problem.message).any(|word| word == rest);
    // A problem of a table may come from one of its keys. The other keys of the table are only blamed if there is no better place.
    latest(&|assigned| rest_below(key, assigned).is_some())
        .or_else(|| latest(&|assigned| rest_below(assigned, key).is_some_and(is_quoted)))
        .or_else(|| {
            layers.iter().find_map(|layer| {
                let line = line_of(key, &problem.message, layer.text)?;
                Some(format!("{}, line {line}", layer.name))
            })
        })
        .or_else(|| latest(&|assigned| rest_below(assigned, key).is_some()))
}

/// The key of an assignment, without quotes and spaces.
fn assigned_key(assignment: &str) -> String {
    let key = assignment.split('=').next().unwrap_or_default();
    let parts: Vec<&str> = key
        .split('.')
        .map(|part| part.trim().trim_matches('"'))
        .collect();
    parts.join(".")
}

/// The rest of a key below one of its tables or lists, or an empty text for the whole key. The rest below a list begins with the
/// number of an item, such as `[1]`. Returns `None` if the table is not in the key.
fn rest_below<'a>(key: &'a str, table: &str) -> Option<&'a str> {
    let rest = key.strip_prefix(table)?;
    if rest.is_empty() || rest.starts_with('[') {
        Some(rest)
    } else {
        rest.strip_prefix('.')
    }
}

/// The line of a key, counted from 1. If the key is a table, it is the line of the text that the message quotes: one of its keys,
/// or the value of one.
pub(super) fn line_of(key: &str, message: &str, text: &str) -> Option<usize> {
    let table = DeTable::parse(text).ok()?;
    let place = place_in_table(table.get_ref(), key, message)?;
    Some(line_at(text, place))
}

/// The byte of a key in a table. Keys may contain points.
fn place_in_table(table: &DeTable<'_>, key: &str, message: &str) -> Option<usize> {
    let (name, value, rest) = table.iter().find_map(|(name, value)| {
        let rest = rest_below(key, name.get_ref())?;
        Some((name, value, rest))
    })?;
    let place = name.span().start;
    match (value.get_ref(), rest) {
        (DeValue::Table(below), "") => Some(place_of_quoted(below, message).unwrap_or(place)),
        (DeValue::Table(below), rest) => place_in_table(below, rest, message),
        (_, "") => Some(place),
        (DeValue::Array(items), rest) if rest.starts_with('[') => {
            Some(place_in_item(items, rest, message).unwrap_or(place))
        }
        (DeValue::Array(tables), rest) => tables.iter().find_map(|item| {
            let table = item.get_ref().as_table()?;
            place_in_named(table, item.span().start, rest, message)
        }),
        _ => None,
    }
}

/// The byte of an item of a list, or of a key in it. The key begins with the number of the item, such as `[1]`.
fn place_in_item(items: &DeArray<'_>, key: &str, message: &str) -> Option<usize> {
    let (number, rest) = key.strip_prefix('[')?.split_once(']')?;
    let item = items.get(number.parse::<usize>().ok()?)?;
    let below = item.get_ref().as_table().zip(rest.strip_prefix('.'));
    let inner = below.and_then(|(table, key)| place_in_table(table, key, message));
    Some(inner.unwrap_or(item.span().start))
}

/// The byte of a key in one of several tables that a `name` distinguishes. The key begins with the name.
fn place_in_named(table: &DeTable<'_>, place: usize, key: &str, message: &str) -> Option<usize> {
    let (_, name) = table.iter().find(|(key, _)| key.get_ref() == "name")?;
    match rest_below(key, name.get_ref().as_str()?)? {
        "" => Some(place_of_quoted(table, message).unwrap_or(place)),
        rest => place_in_table(table, rest, message),
    }
}

/// The byte of the key, or of the value of a key, that a message quotes.
fn place_of_quoted(table: &DeTable<'_>, message: &str) -> Option<usize> {
    // The message also quotes the expected values, which are not in the text.
    let about = message.split("expected ").next().unwrap_or_default();
    let with_key = |word| table.iter().find(|(key, _)| key.get_ref() == word);
    let with_value = |word| {
        let is_word = |value: &DeValue<'_>| value.as_str() == Some(word);
        let is_value = |value: &DeValue<'_>| {
            let items = value.as_array().into_iter().flat_map(|items| items.iter());
            is_word(value) || items.map(|item| item.get_ref()).any(is_word)
        };
        table.iter().find(|(_, value)| is_value(value.get_ref()))
    };
    let inner = quoted(about)
        .find_map(with_key)
        .or_else(|| quoted(about).find_map(with_value));
    inner.map(|(key, _)| key.span().start)
}

/// The number of the line with a byte, counted from 1.
fn line_at(text: &str, place: usize) -> usize {
    text.as_bytes()
        .iter()
        .take(place)
        .filter(|&&byte| byte == b'\n')
        .count()
        + 1
}

/// Reads a table. An error is described in one line.
///
/// # Errors
/// If the text is not TOML.
pub(super) fn parsed(text: &str, name: &str) -> anyhow::Result<Table> {
    text.parse().map_err(|error: toml::de::Error| {
        let line = line_at(text, error.span().map_or(0, |span| span.start));
        anyhow::anyhow!("{name}, line {line}: {}", error.message().trim_end())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_on_their_lines() {
        let text = "base = \"base\"\n\n[train]\nsteps = 3\nrate = { a = 1,\n b = 2 }\n[net.backbone]\n  depth = 1\npreset = \"huge\"\n";
        let unknown = "unknown variant `huge`, expected one of `depth`";
        for (path, message, line) in [
            ("net.backbone", "type `x` has no key `preset`", Some(9)),
            ("net.backbone", unknown, Some(9)),
            ("net.backbone", "is wrong", Some(7)),
        ] {
            assert_eq!(line_of(path, message, text), line, "{message}");
        }
        for (path, line) in [
            ("base", Some(1)),
            ("train", Some(3)),
            ("train.steps", Some(4)),
            ("train.rate.b", Some(6)),
            ("net.backbone.depth", Some(8)),
            ("train.epochs", None),
            ("train.steps.x", None),
        ] {
            assert_eq!(line_of(path, "", text), line, "{path}");
        }
    }

    #[test]
    fn keys_with_points_and_named_tables_are_found() {
        let text = "[expect]\n\"a/b.miou\" = 1\n[[endpoints]]\nname = \"T1\"\nnoise = 1\n[[endpoints]]\nname = \"T2\"\nnoise = 2\nreferences = [\"x\"]\n";
        for (key, message, line) in [
            ("expect.a/b.miou", "", Some(2)),
            ("expect", "`a/b.miou` names nothing", Some(2)),
            ("endpoints.T1.noise", "", Some(5)),
            ("endpoints.T2.noise", "", Some(8)),
            ("endpoints.T2", "`x` is not a source", Some(9)),
            ("endpoints.T2", "", Some(6)),
            ("endpoints.T3.noise", "", None),
            ("endpoints[0].noise", "", Some(5)),
            ("endpoints[1].noise", "", Some(8)),
            ("endpoints[1].references[0]", "", Some(9)),
            ("endpoints[1]", "missing field `data`", Some(6)),
            ("endpoints[1].shapes", "", Some(6)),
        ] {
            assert_eq!(line_of(key, message, text), line, "{key} {message}");
        }
        let list = "[label]\nemit = [\n  \"labels\",\n  \"pints\",\n]\n";
        assert_eq!(line_of("label.emit[1]", "", list), Some(4));
    }

    #[test]
    fn an_assignment_is_blamed_if_the_problem_is_in_it() {
        let text = "[sources.m]\ntype = \"faces\"\nby = \"ordered\"\n";
        let wrong_by = "sources.m: `by` is `ordered`";
        for (overrides, message, place) in [
            (&[][..], wrong_by, "f.toml, line 3"),
            (&["sources.m.path=x"], wrong_by, "f.toml, line 3"),
            (
                &["sources.m.by=ordered"],
                wrong_by,
                "--set sources.m.by=ordered",
            ),
            (
                &["sources.m={by=\"ordered\"}"],
                wrong_by,
                "--set sources.m={by=\"ordered\"}",
            ),
            (
                &["sources.m.by=ordered", "sources.m.path=x"],
                wrong_by,
                "--set sources.m.by=ordered",
            ),
        ] {
            let problem = ConfigProblem::of_key("sources.m".to_owned(), message.to_owned());
            let overrides: Vec<String> = overrides.iter().map(|&set| set.to_owned()).collect();
            let layer = Layer {
                name: "f.toml".to_owned(),
                text,
            };
            let found = position_of(&problem, &overrides, &[layer]);
            assert_eq!(found.as_deref(), Some(place), "{overrides:?}");
            if let [.., last] = overrides.as_slice() {
                let found = position_of(&problem, &overrides, &[]);
                assert!(found.is_some(), "{last}");
            }
        }
    }

    #[test]
    fn the_nearest_name_is_near() {
        assert_eq!(nearest("stepz", &["epochs", "steps"]), Some("steps"));
        assert_eq!(
            nearest("tehta_deg", &["theta_deg", "tau_min"]),
            Some("theta_deg")
        );
        assert_eq!(nearest("color", &["steps"]), None);
        assert_eq!(nearest("a", &[]), None);
        for (name, near) in [
            ("theta", Some("theta_deg")),
            ("chord", Some("chord_fraction")),
            ("max", Some("max_entities")),
            ("the", None),
            ("", None),
        ] {
            let names = [
                "max_triangles",
                "theta_deg",
                "chord_fraction",
                "max_entities",
            ];
            assert_eq!(nearest(name, &names), near, "{name}");
        }
    }

    #[test]
    fn problems_name_their_key() {
        let key = |message: &str| ConfigProblem::of_check(message.to_owned()).key;
        assert_eq!(
            key("label.theta_deg must be from 0 to 180"),
            "label.theta_deg"
        );
        assert_eq!(
            key("one of train.steps and train.epochs must be positive"),
            "train.steps"
        );
        assert_eq!(key("split: each share must be from 0 to 1"), "split");
        assert_eq!(key("endpoints.T1.noise must be 0"), "endpoints.T1.noise");
        assert_eq!(key("sources.step-parts has a name"), "sources.step-parts");
        assert_eq!(key("something else: is wrong"), "");
        assert_eq!(key("must be from 0.5 to 1.5"), "");
        let defaults: Table = "[label]\ntheta_deg = 8".parse().unwrap();
        let problem =
            |path, message| ConfigProblem::of_reading(path, message, &defaults).to_string();
        let unknown = "unknown field `stepz`, expected one of `steps`, `epochs`";
        assert_eq!(problem("train", unknown), problem("train.stepz", unknown));
        assert!(
            problem("train", unknown).ends_with("; did you mean `train.steps`?"),
            "{}",
            problem("train", unknown)
        );
        for unknown in [
            "unknown field `stepz`, expected one of `steps`, `freeze`, `sabotage`",
            "unknown field `stepz`, expected one of `sabotage`, `steps`, `freeze`",
        ] {
            let printed = problem("train", unknown);
            assert!(
                printed.contains("expected one of `steps`, `freeze`;"),
                "{printed}"
            );
        }
        let elsewhere = problem("train", "unknown field `theta_deg`, expected `steps`");
        assert!(
            elsewhere.ends_with("; did you mean `label.theta_deg`?"),
            "{elsewhere}"
        );
        let of_another_type = problem("label", "unknown field `theta_deg`, expected `steps`");
        assert!(
            !of_another_type.contains("did you mean"),
            "{of_another_type}"
        );
        let wrong = problem(
            "train.steps",
            "invalid type: string \"many\", expected usize",
        );
        assert!(
            wrong.ends_with("expected a whole number from 0 up"),
            "{wrong}"
        );
    }
}
