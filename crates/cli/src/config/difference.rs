//! Finds the differences of two settings: two values of the same kind go in, and the different keys with both values come out.

use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt;

/// A key to which two settings give different values. A value is null if the key is missing.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Difference {
    /// The key, for example `label.tau_min`.
    pub(crate) key: String,
    /// The value in the first settings.
    pub(crate) here: Value,
    /// The value in the second settings.
    pub(crate) there: Value,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, here, there } = self;
        if here.is_null() || there.is_null() {
            let [here, there] = [here, there].map(shown);
            return write!(f, "{key} is {here} instead of {there}");
        }
        write!(f, "{key} is {here}, not {there}")
    }
}

/// A value as a message says it.
pub(crate) fn shown(value: &Value) -> String {
    match value {
        Value::Null => "not set".to_owned(),
        value => value.to_string(),
    }
}

/// Every key in which the two differ, sorted.
#[must_use]
pub(crate) fn differences(here: &impl Serialize, there: &impl Serialize) -> Vec<Difference> {
    let (here, there) = (flattened(here), flattened(there));
    let mut keys: Vec<&String> = here.keys().chain(there.keys()).collect();
    keys.sort();
    keys.dedup();
    let value =
        |of: &BTreeMap<String, Value>, key: &str| of.get(key).cloned().unwrap_or(Value::Null);
    let difference = |key: &String| {
        let (here, there) = (value(&here, key), value(&there, key));
        (here != there).then(|| Difference {
            key: key.clone(),
            here,
            there,
        })
    };
    keys.into_iter().filter_map(difference).collect()
}

/// The differences as one clause: `a is 1, not 2; b is 3, not 4`.
#[must_use]
pub(crate) fn listed(differences: &[Difference]) -> String {
    differences
        .iter()
        .map(Difference::to_string)
        .collect::<Vec<_>>()
        .join("; ")
}

/// The settings under keys like `label.tau_min`.
fn flattened(settings: &impl Serialize) -> BTreeMap<String, Value> {
    // Settings are plain structures, which always serialize. Settings from a file were written as JSON text, which may change the
    // last digit of a number. So all settings are converted to text and back.
    let text = serde_json::to_string(settings).unwrap_or_default();
    let mut open = vec![(
        String::new(),
        serde_json::from_str(&text).unwrap_or(Value::Null),
    )];
    let mut flat = BTreeMap::new();
    while let Some((key, value)) = open.pop() {
        match value {
            Value::Object(fields) => open.extend(fields.into_iter().map(|(name, value)| {
                let key = if key.is_empty() {
                    name
                } else {
                    format!("{key}.{name}")
                };
                (key, value)
            })),
            value => {
                flat.insert(key, value);
            }
        }
    }
    flat
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn keys_are_named_with_both_values() {
        let here = json!({ "a": { "x": 1, "y": [1, 2] }, "b": 0.1 });
        let there = json!({ "a": { "x": 2, "y": [1, 2] }, "b": 0.1, "c": "new" });
        let found = differences(&here, &there);
        assert_eq!(
            listed(&found),
            "a.x is 1, not 2; c is not set instead of \"new\""
        );
        assert_eq!(differences(&here, &here), []);
    }
}
