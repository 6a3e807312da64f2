//! Reads solids that a file defines by their construction. A single primitive becomes a body of faces. Others (Boolean results,
//! sweeps, replicas) are named but not evaluated.

use super::construction_classes::is_primitive;
use super::error::{EntityError, Problem};
use super::file::StepFile;
use super::space::Reader;
use super::topology::TopologyBuilder;
use crate::model::LostKind;
use crate::part21::{Keyword, Param, Record};

impl<'s, 'a> TopologyBuilder<'s, 'a> {
    /// Adds a primitive. A solid that would have to be evaluated is named with its construction.
    pub(super) fn add_construction(&mut self, reader: Reader<'s, 'a>, record: Record) {
        let outcome = match self
            .source
            .entity(record.id, |record| tree_root(self.source, record))
        {
            Ok(root) if is_primitive(root.keyword) => self.add_primitive(reader, record, root),
            Ok(root) => Err(Problem::Construction(description(self.source, record, root)).into()),
            Err(error) => Err(error),
        };
        if let Err(error) = outcome {
            self.lose(LostKind::Entity, record.id, &error.within(record.id));
        }
    }
}

/// The construction of a solid: the root of the tree of a `CSG_SOLID`, or the entity itself for any other class.
fn tree_root(source: &StepFile<'_>, record: Record) -> Result<Record, EntityError> {
    let params = match record.keyword {
        Keyword::CsgSolid => source.class_params(record, "CSG_SOLID", 1)?,
        Keyword::Complex => match source.exchange.partial(record, "CSG_SOLID") {
            Some(params) => params,
            None => return Ok(record),
        },
        _ => return Ok(record),
    };
    let [root] = params.first()?;
    source.record(root.reference()?)
}

/// The class of a construction, and the operator at the root of its tree.
fn description(source: &StepFile<'_>, record: Record, root: Record) -> String {
    let (class, of) = (
        source.exchange.class_name(record),
        source.exchange.class_name(root),
    );
    let operator = match source.params(root) {
        Ok([_, Param::Enum(operator)]) if root.keyword == Keyword::BooleanResult => {
            format!(" ({})", String::from_utf8_lossy(operator).to_lowercase())
        }
        _ => String::new(),
    };
    if record.id == root.id {
        format!("{class}{operator}")
    } else {
        format!("{class} of {of} #{}{operator}", root.id)
    }
}
