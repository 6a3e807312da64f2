//! Checks `train.freeze`: each name must be the name of a part of the network, and some part must be left to train.

use crate::config::{Config, nearest};
use crate::usage::UsageError;
use anyhow::{Result, bail};
use partprobe_net::Model;

/// Refuses a part that the network does not have, and a network of which all parts are frozen, before a run folder is made.
///
/// # Errors
/// If a name of `train.freeze` is not the beginning of a parameter's name, or if no part is left to train. The message suggests a
/// similar name.
pub(crate) fn ensure_frozen_parts(config: &Config) -> Result<()> {
    if config.train.freeze.is_empty() {
        return Ok(());
    }
    let names = Model::part_names(&config.net)?;
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    for part in &config.train.freeze {
        let below = part.strip_prefix("backbone.").unwrap_or(part);
        if below == "backbone" || names.contains(&below) {
            continue;
        }
        let near = nearest(below, &names).map_or_else(
            || "; parts are `stem`, `encoder.0`, `decoder`, `head` and so on".to_owned(),
            |near| format!("; did you mean `{near}`?"),
        );
        bail!(UsageError(format!(
            "train.freeze: the network has no part `{part}`{near}"
        )));
    }

    let is_frozen = |name: &str| {
        config.train.freeze.iter().any(|part| {
            let below = part.strip_prefix("backbone.").unwrap_or(part);
            below == name || (below == "backbone" && name != HEAD)
        })
    };
    let mut sections = names.iter().filter(|name| !name.contains('.'));
    if sections.all(|name| is_frozen(name)) {
        bail!(UsageError(
            "train.freeze names all parts of the network, so nothing would be trained; leave one out".to_owned()
        ));
    }
    Ok(())
}

/// The part that does not belong to the backbone.
const HEAD: &str = "head";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::load;

    #[track_caller]
    fn check(parts: &str, expected: Result<(), &str>) {
        let config = load("smoke", &[format!("train.freeze={parts}")])
            .unwrap()
            .config;
        match (ensure_frozen_parts(&config), expected) {
            (Ok(()), Ok(())) => {}
            (Err(message), Err(expected)) => {
                assert!(message.to_string().contains(expected), "{message}")
            }
            (found, expected) => panic!("{found:?}, expected {expected:?}"),
        }
    }

    #[test]
    fn a_part_is_named_as_its_parameters_are() {
        check("[]", Ok(()));
        check(
            r#"["stem", "encoder.0", "backbone.encoder.1.blocks.0", "head"]"#,
            Ok(()),
        );
        check(
            r#"["encodr.0"]"#,
            Err("no part `encodr.0`; did you mean `encoder.0`?"),
        );
        check(r#"["backbone"]"#, Ok(()));
        for all in [
            r#"["backbone", "head"]"#,
            r#"["stem", "encoder", "decoder", "head"]"#,
        ] {
            check(all, Err("names all parts of the network"));
        }
        check(r#"["encoder.7"]"#, Err("did you mean `encoder."));
        check(r#"["q"]"#, Err("parts are `stem`"));
    }
}
