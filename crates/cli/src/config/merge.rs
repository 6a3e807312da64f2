//! Merges names, files and overrides into one table.

use super::Config;
use super::chain::{ConfigText, chain};
use super::flag::{as_written, without_flag};
use super::problem::{ConfigProblem, Layer, position_of, suggestion};
use crate::usage::as_usage_error;
use anyhow::{Context, Result, anyhow, bail};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// A config that is built into the program.
struct Shipped {
    name: &'static str,
    /// Its purpose, which `config list` prints.
    about: &'static str,
    text: &'static str,
}

/// The configs that are built into the program.
const SHIPPED: [Shipped; 12] = [
    Shipped {
        name: "base",
        about: "Every default; your own config starts from it or from another one",
        text: include_str!("../../configs/base.toml"),
    },
    Shipped {
        name: "smoke",
        about: "A complete experiment on generated parts, in less than three minutes on two cores",
        text: include_str!("../../configs/smoke.toml"),
    },
    Shipped {
        name: "abc-small",
        about: "A short training on the distinct solids of STEP files with 2 to 20 parts",
        text: include_str!("../../configs/abc-small.toml"),
    },
    Shipped {
        name: "synth",
        about: "A training on generated parts with three seeds",
        text: include_str!("../../configs/synth.toml"),
    },
    Shipped {
        name: "real-small",
        about: "A training on STEP files with 2 to 20 parts, where each file is a shape",
        text: include_str!("../../configs/real-small.toml"),
    },
    Shipped {
        name: "implicit",
        about: "The implicit probe of the paper (§4.5): a network per shape, label source and seed",
        text: include_str!("../../configs/implicit.toml"),
    },
    Shipped {
        name: "litept",
        about: "The backbone LitePT: convolutions on the fine levels, attention on the coarse ones",
        text: include_str!("../../configs/litept.toml"),
    },
    Shipped {
        name: "ptx",
        about: "The backbone PointTransformerX: attention without convolutions",
        text: include_str!("../../configs/ptx.toml"),
    },
    Shipped {
        name: "pointnet",
        about: "The backbone PointNet, a baseline without neighborhoods",
        text: include_str!("../../configs/pointnet.toml"),
    },
    Shipped {
        name: "probe",
        about: "The downstream probe of the paper: two label sources, one network, three seeds each",
        text: include_str!("../../configs/probe.toml"),
    },
    Shipped {
        name: "hour",
        about: "An hour of training for one label source",
        text: include_str!("../../configs/hour.toml"),
    },
    Shipped {
        name: "verdict",
        about: "The trainings of `partprobe verdict`, which sets the sources and the number of updates",
        text: include_str!("../../configs/verdict.toml"),
    },
];

/// The names of the shipped configs. `base` is the first one.
pub(crate) fn shipped_names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|shipped| shipped.name)
}

/// The name and the purpose of each shipped config.
pub(crate) fn shipped_descriptions() -> impl Iterator<Item = [&'static str; 2]> {
    SHIPPED.iter().map(|shipped| [shipped.name, shipped.about])
}

/// A config with the table from which it was read.
#[derive(Clone, Debug)]
pub(crate) struct LoadedConfig {
    /// The file's stem or the shipped name. Run folders are named after it.
    pub(crate) name: String,
    /// The typed, checked settings.
    pub(crate) config: Config,
    /// The merged TOML, which is written into the run folder.
    pub(crate) merged: String,
    origin: ConfigOrigin,
}

/// The texts from which a config was read. They are used to find the place of a key.
#[derive(Clone, Debug)]
struct ConfigOrigin {
    name_or_path: String,
    /// The name and the text of each file, the last one first.
    files: Vec<(String, String)>,
    overrides: Vec<String>,
}

impl ConfigOrigin {
    /// The place of the key of a problem: a file with its line, an argument, or the name of the config.
    fn place_of(&self, problem: &ConfigProblem) -> String {
        let layers: Vec<Layer<'_>> = self
            .files
            .iter()
            .map(|(name, text)| Layer {
                name: name.clone(),
                text,
            })
            .collect();
        position_of(problem, &self.overrides, &layers)
            .unwrap_or_else(|| format!("config `{}`", self.name_or_path))
    }

    /// Adds the place of its key to an error.
    fn located(&self, error: anyhow::Error) -> anyhow::Error {
        let place = match error.downcast_ref() {
            Some(problem) => self.place_of(problem),
            None => format!("config `{}`", self.name_or_path),
        };
        error.context(place)
    }
}

impl LoadedConfig {
    /// Adds the place of the key that the message names, and makes the error one of the caller. Stages use it for what they check
    /// after the config was loaded.
    pub(crate) fn located(&self, error: &anyhow::Error) -> anyhow::Error {
        let problem = ConfigProblem::of_check(format!("{error:#}"));
        as_usage_error(self.origin.located(problem.into()))
    }

    /// The same config with another table.
    pub(super) fn with_merged(&self, table: Table) -> Result<Self> {
        from_table(self.name.clone(), table, self.origin.clone()).map_err(as_usage_error)
    }
}

/// Loads a shipped config by name or a file by path, and applies `key=value` overrides in order.
///
/// # Errors
/// If the file cannot be read, a key is unknown, a value has the wrong type or a value is out of range:
/// each is an error of the caller.
pub(crate) fn load(name_or_path: &str, overrides: &[String]) -> Result<LoadedConfig> {
    let loaded = read_text(name_or_path)
        .and_then(|(name, text, path)| load_text(name_or_path, (name, &text, path), overrides));
    loaded.map_err(as_usage_error)
}

/// The same for the text of the standard input. A `base` in it is found from the working folder.
///
/// # Errors
/// As for [`load`], or if the standard input cannot be read.
pub(crate) fn load_standard_input(overrides: &[String]) -> Result<LoadedConfig> {
    let text = io::read_to_string(io::stdin()).context("reading the standard input")?;
    let named = ("stdin".to_owned(), text.as_str(), Some(PathBuf::from("-")));
    load_text("standard input", named, overrides).map_err(as_usage_error)
}

fn load_text(
    name_or_path: &str,
    (name, text, path): (String, &str, Option<PathBuf>),
    overrides: &[String],
) -> Result<LoadedConfig> {
    let chain = chain(name_or_path, text, path.as_deref())?;
    let mut table = merged(&chain);
    for assignment in overrides {
        set(&mut table, assignment).with_context(|| as_written(assignment))?;
    }
    let files = chain.into_iter().filter(ConfigText::is_file);
    let origin = ConfigOrigin {
        name_or_path: name_or_path.to_owned(),
        files: files.map(|config| (config.name, config.text)).collect(),
        overrides: overrides.to_vec(),
    };
    from_table(name, table, origin.clone()).map_err(|error| origin.located(error))
}

/// Merges each config over those on which it is based.
fn merged(chain: &[ConfigText]) -> Table {
    let mut merged = Table::new();
    for config in chain.iter().rev() {
        overlay_config(&mut merged, config.table.clone());
    }
    merged
}

fn from_table(name: String, table: Table, origin: ConfigOrigin) -> Result<LoadedConfig> {
    let merged = toml::to_string(&table)?;
    let read: Result<Config, _> = serde_path_to_error::deserialize(Value::Table(table));
    let config = read.map_err(|error| {
        let (path, message) = (error.path().to_string(), error.inner().message().to_owned());
        ConfigProblem::of_reading(&path, &message, &defaults())
    })?;
    config
        .check()
        .map_err(|error| match error.downcast::<ConfigProblem>() {
            Ok(problem) => problem,
            Err(error) => ConfigProblem::of_check(format!("{error:#}")),
        })?;
    Ok(LoadedConfig {
        name,
        config,
        merged,
        origin,
    })
}

/// Every existing key. It is used to find the key that the user meant.
fn defaults() -> Table {
    shipped("base")
        .and_then(|text| text.parse().ok())
        .unwrap_or_default()
}

/// The config's name, its text, and its path, or `None` for a shipped config.
pub(super) fn read_text(name_or_path: &str) -> Result<(String, String, Option<PathBuf>)> {
    if let Some(text) = shipped(name_or_path) {
        return Ok((name_or_path.to_owned(), text.to_owned(), None));
    }
    let path = Path::new(name_or_path);
    if path.try_exists().is_ok_and(|exists| !exists) {
        let names: Vec<&str> = shipped_names().collect();
        let names = names.join(", ");
        bail!(
            "`{name_or_path}` is neither a file nor a shipped config ({names}){}",
            suggestion(name_or_path, &names)
        );
    }
    let text = fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))?;
    let stem = path.file_stem().map_or_else(
        || "run".to_owned(),
        |stem| stem.to_string_lossy().into_owned(),
    );
    Ok((stem, text, Some(path.to_owned())))
}

/// The text of a shipped config.
pub(crate) fn shipped(name: &str) -> Option<&'static str> {
    SHIPPED
        .iter()
        .find(|shipped| shipped.name == name)
        .map(|shipped| shipped.text)
}

/// Keys of `[train]` with the same meaning in two units. If one is set, the other is unset. A value of 0 means "not set".
const ALTERNATIVES: [[&str; 2]; 2] = [["steps", "epochs"], ["valid_every", "valid_every_epochs"]];

/// Merges a whole config over another one.
fn overlay_config(lower: &mut Table, upper: Table) {
    if let (Some(Value::Table(below)), Some(Value::Table(above))) =
        (lower.get_mut("train"), upper.get("train"))
    {
        for [a, b] in ALTERNATIVES {
            for (key, other) in [(a, b), (b, a)] {
                let is_set = above
                    .get(key)
                    .is_some_and(|value| value.as_integer() != Some(0));
                if is_set && !above.contains_key(other) {
                    below.insert(other.to_owned(), Value::Integer(0));
                }
            }
        }
    }
    overlay(lower, upper);
}

/// Merges `upper` over `lower`, table by table. A table with a `type` replaces a whole table of another type.
pub(super) fn overlay(lower: &mut Table, upper: Table) {
    for (key, value) in upper {
        match (lower.get_mut(&key), value) {
            (Some(Value::Table(below)), Value::Table(above)) if same_variant(below, &above) => {
                overlay(below, above)
            }
            (_, value) => {
                lower.insert(key, value);
            }
        }
    }
}

fn same_variant(below: &Table, above: &Table) -> bool {
    match (below.get("type"), above.get("type")) {
        (Some(below), Some(above)) => below == above,
        // In a user's own table, the type may be the last key.
        _ => true,
    }
}

/// Applies one `key.path=value`. The value is TOML, or a bare word that is read as text.
pub(super) fn set(table: &mut Table, assignment: &str) -> Result<()> {
    let (key, value) = without_flag(assignment)
        .split_once('=')
        .ok_or_else(|| anyhow!("expected key=value, for example label.theta_deg=12"))?;
    let parsed: Result<Table, _> = format!("{key} = {value}").parse();
    let above = match parsed {
        Ok(above) => above,
        // The value is not TOML: a word like `analytic` needs no quotes on a command line.
        Err(_) => {
            let quoted = format!("{key} = {}", Value::String(value.trim().to_owned()));
            quoted.parse().map_err(|_| {
                anyhow!("`{key}` is not a key; write for example label.theta_deg=12")
            })?
        }
    };
    for name in OPEN_TABLES {
        if above
            .get(name)
            .and_then(Value::as_table)
            .is_some_and(Table::is_empty)
        {
            table.remove(name);
        }
    }
    overlay_config(table, above);
    Ok(())
}

/// Tables with keys of the user. `--set expect={}` empties one, because there is no value that would mean "no bound".
const OPEN_TABLES: [&str; 2] = ["expect", "sources"];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shipped_configs_load() {
        for name in shipped_names() {
            let loaded = load(name, &[]).unwrap();
            let again: Table = loaded.merged.parse().unwrap();
            assert_eq!(loaded.with_merged(again).unwrap().config, loaded.config);
        }
    }

    #[test]
    fn an_empty_table_removes_all_bounds() {
        let bounds = |set: &[String]| load("smoke", set).unwrap().config.expect.len();
        assert!(bounds(&[]) > 0);
        assert_eq!(bounds(&["expect={}".to_owned()]), 0);
    }

    #[track_caller]
    fn check_refusal(overrides: &[&str], expected: &str) {
        let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
        let message = format!("{:#}", load("base", &overrides).unwrap_err());
        assert!(
            message.contains(expected),
            "`{message}` does not say `{expected}`"
        );
    }

    #[test]
    fn what_is_misspelt_or_out_of_range_is_refused() {
        check_refusal(&["train.stepz=3"], "unknown field `stepz`");
        check_refusal(&["training.steps=3"], "unknown field `training`");
        check_refusal(&["train.steps=many"], "invalid type");
        check_refusal(&["train.batch_shapes=0"], "train.batch_shapes");
        check_refusal(&["train.steps=0"], "train.steps and train.epochs");
        check_refusal(
            &["train.epochs=2", "train={steps=3, epochs=2}"],
            "train.steps and train.epochs",
        );
        check_refusal(
            &["train.patience=2", "train.valid_every=0"],
            "train.patience",
        );
        check_refusal(&["train.accumulate=0"], "train.accumulate");
        check_refusal(&["train.sabotage=hammer"], "unknown variant `hammer`");
        check_refusal(&["label.theta_deg=-1"], "label.theta_deg");
        check_refusal(&["split.train=0.9"], "split");
        check_refusal(&["compare.supervision=[]"], "compare.supervision");
        check_refusal(&["compare.seeds=[0, 0]"], "compare.seeds");
        check_refusal(
            &["compare.supervision=[\"a\", \"a\"]"],
            "compare.supervision",
        );
        check_refusal(
            &["eval.clusterers=[\"k-means\", \"k-means\"]"],
            "eval.clusterers",
        );
        for (name, expected) in [
            ("pointcept", "Pointcept"),
            ("ward-20", "built-in"),
            ("Mine", "a to z"),
        ] {
            let table = format!("sources.{name}={{ type = \"faces\", path = \"labels.csv\" }}");
            check_refusal(&[&table], expected);
        }
        check_refusal(&["sample.n_points=99999999999999"], "sample.n_points");
        check_refusal(&["net.backbone.orders=[]"], "net.backbone.orders");
        check_refusal(&["net.backbone.orders=[\"morton\"]"], "morton");
        check_refusal(&["net.backbone.norm=group"], "group");
        check_refusal(&["net.backbone.drop_path=1"], "net.backbone.drop_path");
        check_refusal(&["net.backbone.xcep=false"], "unknown field `xcep`");
        check_refusal(&["tokens.voxels=cubes"], "cubes");
        check_refusal(&["steps"], "key=value");
    }

    #[test]
    fn a_quoted_key_may_hold_dots() {
        let set = r#"expect."a/b.miou"=">= 0.5""#.to_owned();
        assert_eq!(
            load("base", &[set]).unwrap().config.expect["a/b.miou"],
            ">= 0.5"
        );
    }

    #[test]
    fn epochs_replace_steps() {
        let load = |overrides: &[&str]| {
            let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
            load("base", &overrides).unwrap().config.train
        };
        let train = load(&[
            "train.epochs=3",
            "train.valid_every_epochs=1",
            "train.accumulate=2",
        ]);
        assert_eq!((train.steps, train.epochs, train.valid_every), (0, 3, 0));
        // There are eight shapes per update, so 17 shapes need three updates.
        assert_eq!(
            (train.n_steps(17), train.n_steps_between_validations(17)),
            (9, 3)
        );
        // A value of 0 unsets nothing, wherever it stands.
        for zero in [
            ["train.steps=5", "train.epochs=0"],
            ["train.epochs=0", "train.steps=5"],
        ] {
            assert_eq!((load(&zero).steps, load(&zero).epochs), (5, 0));
        }
        let back = load(&["train.epochs=3", "train.steps=5"]);
        assert_eq!((back.n_steps(17), back.epochs), (5, 0));
    }

    #[test]
    fn overrides_win() {
        let loaded = load(
            "smoke",
            &[
                "train.steps=7".to_owned(),
                "sample.normals=analytic".to_owned(),
            ],
        )
        .unwrap();
        assert_eq!(loaded.config.train.steps, 7);
        assert_eq!(
            loaded.config.sample.normals,
            super::super::NormalConfig::Analytic
        );
    }
}
