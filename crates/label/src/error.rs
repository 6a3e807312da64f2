//! Lists the reasons why a file or one of its shapes has no carrier.

use partprobe_brep::ReadError;
use partprobe_carrier::{CarrierError, GivenError};
use partprobe_sources::SourceError;
use partprobe_truck::TruckError;

/// Why a file or one of its shapes has no carrier.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LabelError {
    /// The text cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The mesh is larger than the options allow.
    #[error(
        "the mesh has more than {limit} triangles; raise label.max_triangles or the tolerances"
    )]
    TooManyTriangles {
        /// The most triangles that the options allow.
        limit: u64,
    },
    /// Every face was lost.
    #[error("no face could be triangulated; {n_lost} were lost")]
    NoTriangle {
        /// How many faces, loops and entities were lost.
        n_lost: usize,
    },
    /// Each solid is asked for, and the file has none.
    #[error("no face of the file belongs to a solid; label with label.unit = \"file\"")]
    NoSolid,
    /// A layer is asked for that no source gives, or whose source does not label whole faces.
    #[error(transparent)]
    Layer(#[from] SourceError),
    /// The second kernel is asked for what it cannot do.
    #[error("truck labels whole files without instances; use the own kernel, or Unit::File")]
    WholeFilesOnly,
    /// The kernel's answer contradicts itself.
    #[error(transparent)]
    Carrier(#[from] CarrierError),
    /// A mesh or a point cloud has no carrier.
    #[error(transparent)]
    Given(#[from] GivenError),
    /// The second kernel cannot read the text.
    #[error(transparent)]
    Truck(#[from] TruckError),
}

impl LabelError {
    /// Whether the file asks for more than the options allow, so that other options would read it.
    #[must_use]
    pub fn is_over_budget(&self) -> bool {
        matches!(
            self,
            Self::TooManyTriangles { .. } | Self::Read(ReadError::OverBudget { .. })
        )
    }
}
