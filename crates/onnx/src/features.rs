//! Passes points or triangles to a model, and reads one row of features for each of them.
//!
//! If the declared tensors of a model do not fit, this is found before the model runs. Other errors are found after it. Every
//! message names the model, the tensor, what was found and what is expected.

use crate::error::OnnxError;
use crate::frame::in_frame;
use crate::items::Items;
use crate::layout::{NoLayout, Placement, layout_of_output, possible_shapes};
use crate::model::Model;
use crate::settings::{Per, Settings};
use crate::tensor::{Dimensions, Element, InputTensor, InputValues, OutputTensor, TensorSpec};
use partprobe_carrier::{Embeddings, Point};

/// What goes into an input, in the order in which it is put into one that gets several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quantity {
    Position,
    Normal,
    Area,
}

impl Quantity {
    fn length(self) -> usize {
        match self {
            Self::Position | Self::Normal => 3,
            Self::Area => 1,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Position => "positions",
            Self::Normal => "normals",
            Self::Area => "areas",
        }
    }
}

/// An input of the model and the data that go into it.
#[derive(Clone, Debug, PartialEq)]
enum Feed {
    /// One row of numbers per point or triangle.
    Rows {
        spec: TensorSpec,
        quantities: Vec<Quantity>,
        placement: Placement,
    },
    /// The number of rows.
    Count { spec: TensorSpec },
}

/// A model whose tensors fit the config.
pub(crate) struct FeatureModel {
    /// The name of the model in messages: the path of its file.
    path: String,
    model: Box<dyn Model>,
    settings: Settings,
    feeds: Vec<Feed>,
    output: String,
}

impl FeatureModel {
    /// Checks the declared tensors of a model against the config.
    ///
    /// # Errors
    /// If a tensor that a key names is missing, an input gets nothing, or a type or dimension does not fit.
    pub(crate) fn new(
        path: &str,
        model: Box<dyn Model>,
        settings: Settings,
    ) -> Result<Self, OnnxError> {
        check_names(path, model.as_ref(), &settings)?;
        let feeds = model
            .inputs()
            .iter()
            .map(|spec| feed(path, spec, &settings))
            .collect::<Result<Vec<Feed>, OnnxError>>()?;
        let output = output_name(path, model.outputs(), settings.features.as_deref())?;
        Ok(Self {
            path: path.to_owned(),
            model,
            settings,
            feeds,
            output,
        })
    }

    pub(crate) fn settings(&self) -> &Settings {
        &self.settings
    }

    pub(crate) fn runtime(&self) -> &str {
        self.model.runtime()
    }

    /// The number of points or triangles for which the model was made, or `None` if it accepts any number.
    pub(crate) fn n_rows(&self) -> Option<usize> {
        self.feeds.iter().find_map(|feed| match feed {
            Feed::Rows { placement, .. } => placement.n_rows,
            Feed::Count { .. } => None,
        })
    }

    /// One row of finite features for each item. `corners` are the vertices of the shape.
    ///
    /// # Errors
    /// If the model cannot run on them, or the output is not one row of finite numbers for each.
    pub(crate) fn features(
        &self,
        items: &Items,
        corners: &[Point],
    ) -> Result<Embeddings, OnnxError> {
        let positions = in_frame(
            &items.positions,
            corners,
            self.settings.frame,
            self.settings.factor,
        );
        let inputs = self
            .feeds
            .iter()
            .map(|feed| self.tensor(feed, items, &positions))
            .collect::<Result<Vec<InputTensor>, OnnxError>>()?;
        let output = self
            .model
            .run(inputs, &self.output)
            .map_err(|reason| OnnxError::Run {
                model: self.path.clone(),
                runtime: self.runtime().to_owned(),
                reason,
            })?;
        self.rows(output, items.len())
    }

    fn tensor(
        &self,
        feed: &Feed,
        items: &Items,
        positions: &[Point],
    ) -> Result<InputTensor, OnnxError> {
        let n_rows = items.len();
        match feed {
            Feed::Count { spec } => Ok(InputTensor {
                name: spec.name.clone(),
                shape: vec![1; spec.shape.len()],
                values: InputValues::I64(vec![n_rows as i64]),
            }),
            Feed::Rows {
                spec,
                quantities,
                placement,
            } => {
                self.check_count(spec, placement, n_rows)?;
                let length = quantities.iter().map(|quantity| quantity.length()).sum();
                let rows = rows_of(quantities, items, positions);
                Ok(InputTensor {
                    name: spec.name.clone(),
                    shape: placement.shape(n_rows, length),
                    values: InputValues::F32(placement.layout.pack(rows, length)),
                })
            }
        }
    }

    fn check_count(
        &self,
        spec: &TensorSpec,
        placement: &Placement,
        n_found: usize,
    ) -> Result<(), OnnxError> {
        match placement.n_rows {
            Some(n_expected) if n_expected != n_found => Err(OnnxError::Count {
                model: self.path.clone(),
                tensor: spec.to_string(),
                items: items_name(&self.settings),
                n_expected,
                n_found,
                remedy: match self.settings.per {
                    Per::Point { .. } => "leave `points` unset, or set it to this number",
                    Per::Triangle { .. } => {
                        "export the model with a dynamic number of triangles, or use `per = \"point\"`"
                    }
                },
            }),
            _ => Ok(()),
        }
    }

    fn rows(&self, output: OutputTensor, n_rows: usize) -> Result<Embeddings, OnnxError> {
        let requested = self.settings.features_layout;
        let (layout, length) = layout_of_output(&output.shape, n_rows, requested)
            .map_err(|problem| self.no_output_layout(problem, &output.shape, n_rows))?;
        let values = layout.unpack(output.values, n_rows);
        if let Some(at) = values.iter().position(|value| !value.is_finite()) {
            return Err(OnnxError::NotFinite {
                model: self.path.clone(),
                tensor: self.output.clone(),
                value: values[at].to_string(),
                row: at / length,
                n_rows,
            });
        }
        Embeddings::new(length, values).map_err(|error| OnnxError::Run {
            model: self.path.clone(),
            runtime: self.runtime().to_owned(),
            reason: error.to_string(),
        })
    }

    fn no_output_layout(&self, problem: NoLayout, shape: &[usize], n_rows: usize) -> OnnxError {
        let found: Vec<Option<usize>> = shape.iter().copied().map(Some).collect();
        let tensor = format!("output `{}` {}", self.output, Dimensions(&found));
        let items = items_name(&self.settings);
        match problem {
            NoLayout::Both => OnnxError::Layout {
                model: self.path.clone(),
                tensor,
                items,
                key: "features_layout",
            },
            NoLayout::Unfit => OnnxError::Shape {
                model: self.path.clone(),
                tensor,
                content: format!("features of {n_rows} {items}"),
                expected: possible_shapes(Some(n_rows), None),
                remedy: "set `features` to an output with one row per point or triangle",
            },
        }
    }
}

/// `points` or `triangles`.
fn items_name(settings: &Settings) -> &'static str {
    match settings.per {
        Per::Point { .. } => "points",
        Per::Triangle { .. } => "triangles",
    }
}

/// The data that the config puts into an input, in order.
fn quantities_of(settings: &Settings, input: &str) -> Vec<Quantity> {
    let names = &settings.inputs;
    let all = [
        (Quantity::Position, &names.positions),
        (Quantity::Normal, &names.normals),
        (Quantity::Area, &names.areas),
    ];
    all.into_iter()
        .filter(|(_, name)| name.as_deref() == Some(input))
        .map(|(quantity, _)| quantity)
        .collect()
}

/// Refuses keys that name inputs which the model does not have.
fn check_names(path: &str, model: &dyn Model, settings: &Settings) -> Result<(), OnnxError> {
    let names = &settings.inputs;
    let keys = [
        ("positions", &names.positions),
        ("normals", &names.normals),
        ("areas", &names.areas),
        ("count", &names.count),
    ];
    let is_input = |name: &str| model.inputs().iter().any(|spec| spec.name == name);
    for (key, name) in keys {
        if let Some(name) = name
            && !is_input(name)
        {
            return Err(OnnxError::NoTensor {
                model: path.to_owned(),
                direction: "input",
                tensor: name.clone(),
                key,
                known: listed(model.inputs()),
            });
        }
    }
    Ok(())
}

fn feed(path: &str, spec: &TensorSpec, settings: &Settings) -> Result<Feed, OnnxError> {
    let quantities = quantities_of(settings, &spec.name);
    if quantities.is_empty() {
        return count_feed(path, spec, settings);
    }
    if spec.element != Element::F32 {
        return Err(wrong_element(path, spec, "float32"));
    }
    let length = quantities.iter().map(|quantity| quantity.length()).sum();
    let placement = Placement::of_input(&spec.shape, length, settings.layout);
    let placement = placement.map_err(|problem| match problem {
        NoLayout::Both => OnnxError::Layout {
            model: path.to_owned(),
            tensor: format!("input {spec}"),
            items: items_name(settings),
            key: "layout",
        },
        NoLayout::Unfit => {
            let contents: Vec<&str> = quantities.iter().map(|quantity| quantity.name()).collect();
            OnnxError::Shape {
                model: path.to_owned(),
                tensor: format!("input {spec}"),
                content: contents.join(" and "),
                expected: possible_shapes(None, Some(length)),
                remedy: "name this input in `positions`, `normals` and `areas` as its dimensions need it, and check `layout`",
            }
        }
    })?;
    Ok(Feed::Rows {
        spec: spec.clone(),
        quantities,
        placement,
    })
}

/// An input that gets no numbers of points must be the one that gets their number.
fn count_feed(path: &str, spec: &TensorSpec, settings: &Settings) -> Result<Feed, OnnxError> {
    if settings.inputs.count.as_deref() != Some(&spec.name) {
        return Err(OnnxError::UnusedInput {
            model: path.to_owned(),
            input: spec.to_string(),
        });
    }
    if spec.element != Element::I64 {
        return Err(wrong_element(path, spec, "int64"));
    }
    let is_one_number = spec
        .shape
        .iter()
        .all(|size| size.is_none_or(|size| size == 1));
    if !is_one_number {
        return Err(OnnxError::Shape {
            model: path.to_owned(),
            tensor: format!("input {spec}"),
            content: "the number of rows".to_owned(),
            expected: "[] or [1]".to_owned(),
            remedy: "name another input in `count`",
        });
    }
    Ok(Feed::Count { spec: spec.clone() })
}

fn wrong_element(path: &str, spec: &TensorSpec, expected: &'static str) -> OnnxError {
    OnnxError::Element {
        model: path.to_owned(),
        tensor: spec.to_string(),
        expected,
    }
}

fn output_name(
    path: &str,
    outputs: &[TensorSpec],
    requested: Option<&str>,
) -> Result<String, OnnxError> {
    let found = match (requested, outputs) {
        (None, [only]) => only,
        (None, _) => {
            return Err(OnnxError::WhichOutput {
                model: path.to_owned(),
                n_outputs: outputs.len(),
                known: listed(outputs),
            });
        }
        (Some(name), _) => {
            let found = outputs.iter().find(|spec| spec.name == name);
            found.ok_or_else(|| OnnxError::NoTensor {
                model: path.to_owned(),
                direction: "output",
                tensor: name.to_owned(),
                key: "features",
                known: listed(outputs),
            })?
        }
    };
    if found.element == Element::F32 {
        Ok(found.name.clone())
    } else {
        Err(wrong_element(path, found, "float32"))
    }
}

fn listed(specs: &[TensorSpec]) -> String {
    let texts: Vec<String> = specs.iter().map(TensorSpec::to_string).collect();
    texts.join(", ")
}

/// The numbers of each item, one item after the other.
fn rows_of(quantities: &[Quantity], items: &Items, positions: &[Point]) -> Vec<f32> {
    let mut rows = Vec::new();
    for (idx, position) in positions.iter().enumerate() {
        for quantity in quantities {
            match quantity {
                Quantity::Position => rows.extend(position.map(|x| x as f32)),
                Quantity::Normal => rows.extend(items.normals[idx].map(|x| x as f32)),
                Quantity::Area => rows.push(items.areas[idx] as f32),
            }
        }
    }
    rows
}
