//! Reads the options of `label` from keyword arguments. They have the names of the keys of `[label]` in a config.
//!
//! Their defaults are those of `LabelOptions`, which a test of the program compares with `configs/base.toml`.

use crate::errors::usage;
use crate::near_name::did_you_mean;
use partprobe_label::{LabelOptions, Unit};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// An option: its name, its value for Python, and the function that sets it.
pub(crate) struct LabelOption {
    /// The name of the keyword argument.
    pub(crate) name: &'static str,
    /// Returns its value in the given options.
    pub(crate) value: fn(&LabelOptions, Python<'_>) -> PyResult<Py<PyAny>>,
    set: fn(&mut LabelOptions, &Bound<'_, PyAny>) -> PyResult<()>,
}

/// Defines an option whose field has the type of the argument.
macro_rules! plain {
    ($name:literal, $($field:tt)+) => {
        LabelOption {
            name: $name,
            value: |options, py| Ok(options.$($field)+.into_pyobject(py)?.to_owned().into_any().unbind()),
            set: |options, value| {
                options.$($field)+ = value.extract()?;
                Ok(())
            },
        }
    };
}

/// All options, in the order of `configs/base.toml`.
pub(crate) const LABEL_OPTIONS: &[LabelOption] = &[
    LabelOption {
        name: "unit",
        value: |options, py| text(py, unit_name(options.unit)),
        set: set_unit,
    },
    plain!("instances", instances),
    plain!("theta_deg", theta_deg),
    plain!("tau_min", tau_min),
    plain!("chord_fraction", tessellation.chord_fraction),
    plain!("angle_rad", tessellation.angle_rad),
    plain!("volume_loss", tessellation.volume_loss),
    LabelOption {
        name: "attributes",
        value: |options, py| {
            Ok(attribute_names(options)
                .into_pyobject(py)?
                .into_any()
                .unbind())
        },
        set: set_attributes,
    },
    LabelOption {
        name: "layers",
        value: |options, py| {
            Ok(options
                .layers
                .clone()
                .into_pyobject(py)?
                .into_any()
                .unbind())
        },
        set: |options, value| {
            options.layers = names(value)?;
            Ok(())
        },
    },
    LabelOption {
        name: "max_file_mb",
        value: |options, py| {
            Ok((options.budget.max_bytes >> 20)
                .into_pyobject(py)?
                .into_any()
                .unbind())
        },
        set: |options, value| {
            options.budget.max_bytes = value.extract::<u32>().map(u64::from)? << 20;
            Ok(())
        },
    },
    plain!("max_entities", budget.max_entities),
    plain!("max_triangles", tessellation.max_triangles),
];

/// Keys of `[label]` that only the program has, and their replacements in Python.
const OF_THE_PROGRAM: [(&str, &str); 5] = [
    ("kernel", "the wheel contains the own kernel only"),
    ("emit", "a carrier contains everything"),
    ("compress", "use `carrier.save(path, compress=True)`"),
    (
        "memory_mb",
        "use `partprobe label`, which labels in processes of their own",
    ),
    (
        "watchdog_s",
        "use `partprobe label`, which labels in processes of their own",
    ),
];

/// The options with these keyword arguments.
///
/// # Errors
/// `TypeError` if an option does not exist or has another type; `UsageError` if its value is out of range.
pub(crate) fn label_options(arguments: Option<&Bound<'_, PyDict>>) -> PyResult<LabelOptions> {
    let mut options = LabelOptions::default();
    for (name, value) in arguments.into_iter().flatten() {
        let name: String = name.extract()?;
        let Some(option) = LABEL_OPTIONS.iter().find(|option| option.name == name) else {
            return Err(unknown(&name));
        };
        (option.set)(&mut options, &value).map_err(|error| of_option(value.py(), &name, error))?;
    }
    check(&options)?;
    Ok(options)
}

fn unknown(name: &str) -> PyErr {
    let of_program = OF_THE_PROGRAM.iter().find(|(key, _)| *key == name);
    let hint = match of_program {
        Some((_, instead)) => format!("; it belongs to the program: {instead}"),
        None => did_you_mean(name, LABEL_OPTIONS.iter().map(|option| option.name)),
    };
    PyTypeError::new_err(format!("`{name}` is not an option of labeling{hint}"))
}

/// The same error, with the name of the option in front if it is a type error.
fn of_option(py: Python<'_>, name: &str, error: PyErr) -> PyErr {
    if error.is_instance_of::<PyTypeError>(py) {
        PyTypeError::new_err(format!("{name}: {}", error.value(py)))
    } else if error.is_instance_of::<pyo3::exceptions::PyOverflowError>(py) {
        usage(format!("{name}: {}", error.value(py)))
    } else {
        error
    }
}

fn check(options: &LabelOptions) -> PyResult<()> {
    let tessellation = &options.tessellation;
    let ranges = [
        ("theta_deg", options.theta_deg, 0.0, 180.0),
        ("chord_fraction", tessellation.chord_fraction, 1e-6, 0.5),
        ("angle_rad", tessellation.angle_rad, 1e-3, 1.5),
        ("volume_loss", tessellation.volume_loss, 0.0, 0.5),
    ];
    for (name, value, least, most) in ranges {
        if !(least..=most).contains(&value) {
            return Err(usage(format!(
                "{name} must be from {least} to {most}, not {value}"
            )));
        }
    }
    if options.instances && options.unit == Unit::Solid {
        return Err(usage(
            "instances places whole assemblies; use it with unit=\"file\"",
        ));
    }
    Ok(())
}

/// A list of names.
fn names(value: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
    value.extract().map_err(|_| {
        PyTypeError::new_err(format!(
            "it must be a list of names, such as [{}]",
            quoted(value)
        ))
    })
}

/// A text as Python writes it, as an example.
fn quoted(value: &Bound<'_, PyAny>) -> String {
    match value.extract::<String>() {
        Ok(text) => format!("\"{text}\""),
        Err(_) => "\"normal\"".to_owned(),
    }
}

fn text(py: Python<'_>, text: &str) -> PyResult<Py<PyAny>> {
    Ok(text.into_pyobject(py)?.into_any().unbind())
}

fn unit_name(unit: Unit) -> &'static str {
    match unit {
        Unit::File => "file",
        Unit::Solid => "solid",
    }
}

fn set_unit(options: &mut LabelOptions, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let name: String = value.extract()?;
    let units = [Unit::File, Unit::Solid];
    let found = units.into_iter().find(|unit| unit_name(*unit) == name);
    options.unit = found.ok_or_else(|| {
        usage(format!(
            "unit must be \"file\" or \"solid\", not \"{name}\""
        ))
    })?;
    Ok(())
}

const ATTRIBUTES: [&str; 3] = ["normal", "uv", "curvature"];

fn attribute_names(options: &LabelOptions) -> Vec<&'static str> {
    let chosen = &options.tessellation.attributes;
    let is_chosen = [chosen.normal, chosen.uv, chosen.curvature];
    let names = ATTRIBUTES.into_iter().zip(is_chosen);
    names
        .filter(|(_, is_chosen)| *is_chosen)
        .map(|(name, _)| name)
        .collect()
}

fn set_attributes(options: &mut LabelOptions, value: &Bound<'_, PyAny>) -> PyResult<()> {
    let names = names(value)?;
    if let Some(other) = names
        .iter()
        .find(|name| !ATTRIBUTES.contains(&name.as_str()))
    {
        let hint = did_you_mean(other, ATTRIBUTES);
        return Err(usage(format!(
            "attributes: `{other}` is not one of normal, uv and curvature{hint}"
        )));
    }
    let has = |name: &str| names.iter().any(|chosen| chosen == name);
    let attributes = &mut options.tessellation.attributes;
    (attributes.normal, attributes.uv, attributes.curvature) =
        (has("normal"), has("uv"), has("curvature"));
    Ok(())
}
